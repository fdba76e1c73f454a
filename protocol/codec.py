"""Encode and decode messages: `msgpack` for the bytes, `msgspec` for the types.

msgspec decodes straight into the message type, so a wrong payload is rejected before any of it is built. Unpacking a
million lists first would block a 1 kHz loop in the same process for half a second. A small wrong payload is unpacked
afterwards, to explain what is wrong with it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from threading import Lock
from typing import TYPE_CHECKING, Any, Literal, TypeVar, cast, get_args, get_origin, get_type_hints

import msgpack
import msgspec

from protocol.errors import Refusal
from protocol.topics import SMALL, Query, id_fault

if TYPE_CHECKING:
    import numpy as np  # costs a command of the shell a third of its start, so only what needs arrays imports it

Kind = TypeVar("Kind", bound=msgspec.Struct)

ENCODING = "application/msgpack"
MAX_DEPTH = 8
MAX_FIELD = 120
MAX_SENTENCE = 400
MAX_ERROR = 2000
"""Characters of msgspec's message that are parsed; it may contain a field name of any length."""
MAX_EXPLAINED = 1 << 12
"""Largest body, bytes, that is unpacked to explain its refusal."""
MAX_BEGINNING = 64
"""Bytes of a body that are searched for JSON."""
_WHERE = re.compile(r"^(?P<what>.*?)(?: - at (?P<key>`key` in )?`\$\.?(?P<path>.*?)`)?$", re.DOTALL)
_VALUE = "[...]"
"""How msgspec ends the path of a value in a map of numbers."""
_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")
_FINITE = re.compile(r"Expected `float` [<>]= ")
_NAMED = re.compile(r"(unknown|required) field `(.*?)`")
_JSON = re.compile(rb"\s*(\{\s*[\"}]|\[\s*[\[\]{\"\d-])")
"""How a JSON map or array begins; in msgpack these bytes would be a small number followed by more."""


def encode(message: msgspec.Struct) -> bytes:
    """Return the msgpack map of `message`, null fields included; NumPy arrays become lists."""
    return cast(bytes, msgpack.packb(msgspec.to_builtins(message, builtin_types=(bytes,), enc_hook=_plain)))


def decode(data: bytes, kind: type[Kind], max_bytes: int = SMALL) -> Kind:
    """Return the message of type `kind` in `data`.

    Raises:
        Refusal: `bad_message`, naming the field, for more than `max_bytes`, broken or trailing bytes, a body that is
            not a map, unknown or missing fields, wrong types, and numbers that are not finite.
    """
    check_size(len(data), max_bytes)
    whole = _with_field(data, kind)
    try:
        return _decoder(kind).decode(whole)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        # No variable of this frame keeps the refusal: with its traceback it would be a cycle.
        raise _refusal_of(error, kind, whole, "" if whole is data else f"{getattr(kind, 'BARE', '')}.") from None


def _with_field(data: bytes, kind: type[msgspec.Struct]) -> bytes:
    """Return a body that is the map of the field `BARE` itself with this field; any other body as it is."""
    if not (field := getattr(kind, "BARE", "")):
        return data
    try:
        values = msgspec.msgpack.decode(data, type=dict[str, msgspec.Raw])
    except (msgspec.DecodeError, UnicodeDecodeError):
        return data
    version = values.pop("version", 1)
    return msgspec.msgpack.encode({"version": version, field: values}) if values and field not in values else data


def _decoder(kind: type[Kind]) -> msgspec.msgpack.Decoder[Kind]:
    """Return the decoder of a type of message.

    Decoders are made one at a time: msgspec crashes if another thread decodes a type while its fields are looked up.
    """
    decoder = _decoders.get(kind)
    if decoder is None:
        with _making_decoder:
            decoder = _decoders.setdefault(kind, msgspec.msgpack.Decoder(kind))
    return decoder


_decoders: dict[type, msgspec.msgpack.Decoder[Any]] = {}
_making_decoder = Lock()


def check_size(size: int, max_bytes: int) -> None:
    """Refuse a body of more than `max_bytes` bytes.

    Raises:
        Refusal: `bad_message`.
    """
    if size > max_bytes:
        raise bad_message("", f"the body has {size} bytes; at most {max_bytes} are allowed here")


def check_request_size(topic: Query, size: int) -> None:
    """Refuse a request of more bytes than its topic takes.

    Raises:
        Refusal: `bad_message`, naming the topic.
    """
    if size > topic.max_bytes:
        hint = f"; {topic.smaller}" if topic.smaller else ""
        raise bad_message("", f"`{topic.key}` takes at most {topic.max_bytes} bytes, and this body has {size}{hint}")


def bad_message(field: str, sentence: str) -> Refusal:
    """Return the refusal of a malformed body; an empty `field` means the whole body."""
    return Refusal("bad_message", _short(sentence, MAX_SENTENCE), field=_short(field, MAX_FIELD))


def check_id(field: str, name: str) -> None:
    """Check that `name` can be the id of a goal or a client.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    if sentence := id_fault(field, name):
        raise bad_message(field, sentence)


def check_lengths(joint_count: int, **vectors: Sequence[Any]) -> None:
    """Check that every vector, passed under the name of its field, has one entry for each joint.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    for field, values in vectors.items():
        if len(values) != joint_count:
            raise bad_message(field, f"{field} has {len(values)} entries; the arm has {joint_count} joints")


def matrix(data: bytes | None, rows: int, columns: int, field: str) -> np.ndarray:
    """Return the (rows, columns) float64 array in `data`, read-only.

    Raises:
        Refusal: `bad_message` if the array is missing, its size does not fit or a number is not finite.
    """
    import numpy as np

    if data is None:
        raise bad_message(field, f"{field} is missing")
    if rows < 0 or columns < 1 or len(data) != 8 * rows * columns:
        wanted = f"{rows} × {columns} little-endian float64 = {8 * rows * columns} bytes"
        raise bad_message(field, f"{field} has {len(data)} bytes; it must be {wanted}, row-major")
    values = np.frombuffer(data, "<f8").reshape(rows, columns)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise bad_message(field, f"{field}[{row}][{column}] is {values[row, column]}; it must be finite")
    return values


def matrix_bytes(values: np.ndarray) -> bytes:
    """Return `values` of any shape in the wire format: little-endian float64, the last index fastest."""
    import numpy as np

    return np.ascontiguousarray(values, "<f8").tobytes()


def _plain(value: Any) -> object:
    """Return NumPy's array or number as Python's."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a value of the type {type(value).__name__} cannot be sent")


def _refusal_of(error: Exception, kind: type[msgspec.Struct], data: bytes, unsaid: str) -> Refusal:
    """Return the refusal that explains why a body could not be decoded.

    unsaid: begin of the paths of its fields that the sender did not write.
    """
    if _JSON.match(data[:MAX_BEGINNING]):
        return bad_message("", "the body looks like JSON; send the same as msgpack")
    body: Any = {}
    if len(data) <= MAX_EXPLAINED:
        try:
            body = msgpack.unpackb(data, strict_map_key=False)
        except msgpack.ExtraData as extra:
            return bad_message("", f"{len(extra.extra)} bytes follow the message; send exactly one map")
        except TypeError:  # a list or a map, which Python cannot take for a key
            return bad_message("", "the body has a list or a map for a key; keys are strings")
        except (msgpack.StackError, ValueError, msgpack.UnpackException) as unreadable:
            return _unreadable(unreadable)  # a variable that keeps it would make a cycle with its traceback
    if not isinstance(body, dict):
        return bad_message("", f"the body is {_describe(body)}; send a msgpack map with string keys")
    if isinstance(error, msgspec.ValidationError):
        found = _explain(error, kind, body)
        return bad_message(*(text.removeprefix(unsaid) for text in (found.detail["field"], found.message)))
    return _unreadable(error)


def _unreadable(error: Exception) -> Refusal:
    """Return the refusal of a body that is not msgpack."""
    if isinstance(error, RecursionError | msgpack.StackError):
        return bad_message("", f"the body is nested too deep; at most {MAX_DEPTH} levels are allowed")
    return bad_message("", f"the body is not msgpack: {str(error) or type(error).__name__}")


def _short(text: str, length: int) -> str:
    """Shorten text from a sender, so that refusals stay small."""
    return text if len(text) <= length else f"{text[: length - 1]}…"


def _describe(body: Any) -> str:
    return f"the msgpack {type(body).__name__} {body!r:.40}"


def _explain(error: msgspec.ValidationError, kind: type[msgspec.Struct], body: dict[str, Any]) -> Refusal:
    """Turn msgspec's message and JSON path into a refusal that names the field. A large `body` is passed as {}."""
    matched = _WHERE.match(_short(str(error), MAX_ERROR))
    what, path = (matched["what"], matched["path"] or "") if matched else (str(error), "")
    if _VALUE in path:
        path = _entry(body, *path.split(_VALUE, 1))
    value = _value_at(body, path)
    if matched and matched["key"]:
        strange = [key for key in (value if isinstance(value, dict) else ()) if not isinstance(key, str)]
        which = f"the key {strange[0]!r:.40}" if strange else "a key that is not a string"
        return bad_message(path, f"{path or 'the body'} has {which}; keys are strings")
    if _FINITE.match(what):
        return bad_message(path, f"{path} is {value or 'not finite'}; it must be finite")
    if _depth(value) > MAX_DEPTH:
        return bad_message(path, f"{_short(path, MAX_FIELD)} is nested more than {MAX_DEPTH} deep")
    named = _NAMED.search(what)
    field = ".".join(part for part in (path, named[2] if named else "") if part)
    if named and named[1] == "required":
        return bad_message(field, f"{field} is missing")
    if named:
        known = "" if path else f"; {kind.__name__} has {', '.join(kind.__struct_fields__)}"
        return bad_message(field, f"{_short(field, MAX_FIELD)} is not a known field{known}")
    sentence = what.replace("`object", "`map").replace("`None`", "null").replace("`", "")
    if sentence.startswith("Invalid enum value"):
        choices = _choices(get_type_hints(kind).get(field))
        sentence += f"; choose from {', '.join(repr(choice) for choice in choices)}" if choices else ""
    return bad_message(field, f"{field}: {sentence[0].lower()}{sentence[1:]}" if field else sentence)


def _entry(body: Any, path: str, inside: str) -> str:
    """Return the path of the first value `inside` an entry of the map at `path` that is not a finite number."""
    values = _value_at(body, path)
    for key, entry in values.items() if isinstance(values, dict) else ():
        value = _value_at(entry, inside, default=0)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            return f"{path}.{key}{inside}"
    return path


def _value_at(body: Any, path: str, default: Any = None) -> Any:
    """Return the value at a path like `waypoints[0].positions[2]`, or `default` if the path does not exist."""
    try:
        for name, index in _STEP.findall(path):
            body = body[int(index)] if index else body[name]
    except (KeyError, IndexError, TypeError):
        return default
    return body


def _depth(value: Any) -> int:
    """Return how deep the first entries of maps and lists are nested."""
    depth = 0
    while isinstance(value, dict | list) and value:
        value = next(iter(value.values() if isinstance(value, dict) else value))
        depth += 1
    return depth


def _choices(hint: Any) -> list[Any]:
    """Return the values that the `Literal`s in a type annotation allow."""
    if get_origin(hint) is Literal:
        return list(get_args(hint))
    return [choice for part in get_args(hint) for choice in _choices(part)]
