"""Read a trace into arrays, one for each entity; docs/trace.md lists the entities."""

import struct
import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
from rerun.chunk import Chunk, LazyChunkStream, RrdReader

SCALARS = "Scalars:scalars"
TIMELINES = ("sim_time", "tick", "wall")
FILE_HEADER_BYTES = 12
MESSAGE_HEADER = struct.Struct("<QQ")
"""Kind and length, bytes, of a message in the file."""
END = 0
"""Kind of a file's last message."""
TRAILER_BYTES = 64
"""A complete file has less than this after its last message."""
COPIED_BYTES = 2**20


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One component of one entity: N rows, in the order of writing.

    Attributes:
        times: Times (N,), int64, by timeline: `sim_time` in ns, `tick` in ticks of the trace, `wall` in Unix ns.
        values: Values of the N rows; an empty list for a row without values.
    """

    times: dict[str, np.ndarray]
    values: list[list[Any]]

    def array(self) -> np.ndarray:
        """Return the n rows with values as float64: (n,) for single values, (n, K) for K values a row."""
        rows = [row for row in self.values if row]
        array = np.array(rows, dtype=np.float64)
        return array[:, 0] if array.ndim == 2 and array.shape[1] == 1 else array

    def ticks(self) -> np.ndarray:
        """Return the ticks (n,) of the rows that `array` returns."""
        return np.array([t for t, row in zip(self.times["tick"].tolist(), self.values, strict=True) if row])


class Trace:
    """A recording in memory."""

    def __init__(self, columns: dict[tuple[str, str], Column]) -> None:
        self._columns = columns

    @property
    def entities(self) -> list[str]:
        """All entities that have data on timelines, sorted."""
        return sorted({entity for entity, _ in self._columns})

    def components(self, entity: str) -> list[str]:
        """Return the names of an entity's components, sorted."""
        return sorted(component for name, component in self._columns if name == entity)

    def column(self, entity: str, component: str = SCALARS) -> Column:
        """Return one component of an entity.

        Raises:
            KeyError: the trace does not contain it; the sentence lists the entity's components, or all entities.
        """
        try:
            return self._columns[entity, component]
        except KeyError:
            known = self.components(entity) or self.entities
            raise KeyError(f"{entity} {component} is not in the trace, which has {', '.join(known)}") from None

    def scalars(self, entity: str) -> np.ndarray:
        """Return the scalars of an entity, (n,) or (n, K), as written."""
        return self.column(entity).array()

    def texts(self, entity: str) -> list[str]:
        """Return the texts of an entity of events."""
        return [text for row in self.column(entity, "TextLog:text").values for text in row]


def read_trace(path: Path) -> Trace:
    """Read the data on timelines of a .rrd file.

    Raises:
        RuntimeError, ValueError: Rerun cannot read the file.
    """
    pieces: dict[tuple[str, str], list[tuple[dict[str, np.ndarray], list[list[Any]]]]] = {}
    for chunk in read_chunks(path):
        batch = chunk.to_record_batch()
        timelines = [name for name in TIMELINES if name in batch.schema.names]
        times = {name: batch.column(name).cast(pa.int64()).to_numpy() for name in timelines}
        for name in batch.schema.names:
            if isinstance(batch.schema.field(name).type, pa.ListType):
                values = [row or [] for row in batch.column(name).to_pylist()]
                pieces.setdefault((chunk.entity_path, name), []).append((times, values))
    return Trace({key: _join(found) for key, found in pieces.items()})


def read_chunks(path: Path, *, static: bool = False) -> Iterator[Chunk]:
    """Yield the chunks of a .rrd file up to its last complete message.

    `static` includes static data, which has no times. The last message is incomplete while a recorder writes it, and
    after a recorder was killed.

    Raises:
        RuntimeError, ValueError: Rerun cannot read the complete messages.
    """
    with TemporaryDirectory() as directory:
        copy = Path(directory) / path.name
        try:
            yield from (chunk for chunk in _opened(path, copy) if static or not chunk.is_static)
        except RuntimeError as error:
            raise RuntimeError(str(error).replace(str(copy), str(path))) from None


def _opened(path: Path, copy: Path) -> LazyChunkStream:
    """Open a file, or a copy of its complete messages if something else follows them."""
    size = path.stat().st_size
    with path.open("rb") as file:
        end = _end_of_messages(file, size)
        if size - end <= TRAILER_BYTES:
            with suppress(RuntimeError):  # an incomplete header of a message may be as short as a trailer
                return _open(path)
        _copy(file, end, copy)
    return _open(copy)


def count_recordings(path: Path) -> int:
    """Return the number of recordings in a .rrd file, 1 for a file without an index; `read_chunks` reads the first."""
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "RRD file has no footer")  # without an index the whole file would be read
        try:
            return len(RrdReader(path).recordings())
        except (RuntimeError, Warning):
            return 1


def _open(path: Path) -> LazyChunkStream:
    with warnings.catch_warnings():  # `volley up` writes traces without an index
        warnings.filterwarnings("ignore", "RRD file has no footer|RRD contains")  # `count_recordings` reports several
        return RrdReader(path).stream()


def _copy(file: BinaryIO, end: int, copy: Path) -> None:
    """Copy a file up to `end`."""
    file.seek(0)
    with copy.open("wb") as beginning:
        while end > 0 and (block := file.read(min(end, COPIED_BYTES))):
            beginning.write(block)
            end -= len(block)


def _end_of_messages(file: BinaryIO, size: int) -> int:
    """Return the position after the message `END`, or after the last complete message."""
    end, kind = FILE_HEADER_BYTES, None
    while kind != END and end + MESSAGE_HEADER.size <= size:
        file.seek(end)
        kind, length = MESSAGE_HEADER.unpack(file.read(MESSAGE_HEADER.size))
        if end + MESSAGE_HEADER.size + length > size:
            break
        end += MESSAGE_HEADER.size + length
    return min(end, size)


def _join(pieces: list[tuple[dict[str, np.ndarray], list[list[Any]]]]) -> Column:
    times = {name: np.concatenate([piece[name] for piece, _ in pieces]) for name in pieces[0][0]}
    return Column(times, [row for _, values in pieces for row in values])
