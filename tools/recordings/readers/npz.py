"""NumPy files: named arrays in a .npz file, or one matrix in a .npy file."""

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy

from tools.recordings import arrays
from tools.recordings.clock import clock_of, seconds
from tools.recordings.names import ONLY_POSES, is_pose, unit_of
from tools.recordings.recording import Episode, Recording, Unit, Unreadable, check_size, head

HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


@dataclass(frozen=True, slots=True)
class Header:
    """Shape and type of an array, read without its data."""

    shape: tuple[int, ...]
    dtype: np.dtype


def episodes(path: Path, rate: float | None) -> list[Episode]:
    """Return a movement for each matrix of positions, and for each layer of an array episodes × samples × joints."""
    found = []
    for name, (array, _) in _matrices(path).items():
        samples = _headers(path)[array].shape[-2]
        check_size(path, name, samples)
        times = _times(path, array, samples, rate)
        found.append(Episode(name, samples, None if times is None else float(times[-1] - times[0])))
    return found


def read(path: Path, episode: str, rate: float | None) -> Recording:
    """Return one matrix as a recording."""
    array, layer = _matrices(path)[episode]
    values = _load(path, array)
    values = np.asarray(values if layer is None else values[layer], dtype=float)
    columns = _columns(path, values.shape[1])
    times, notes = _times(path, array, len(values), rate), ()
    if times is None and _is_plain(path):
        clock = clock_of((), values)
        if clock.columns:
            times, notes, values = seconds(values, clock), clock.notes, values[:, 1:]
    if times is None and _is_plain(path):
        raise Unreadable(
            f"{path} has no names, and its first column does not rise like a time; give --rate, in samples a second, "
            "or save an .npz file with the arrays t and positions"
        )
    if times is None and (said := arrays.transposed(_headers(path), array, values.shape)):
        raise Unreadable(f"{path}: {said}")
    if times is None:
        raise Unreadable(f"{path} has no array of times with {len(values)} numbers; give --rate, in samples a second")
    return Recording(times, columns, values, unit_of(array) or _unit_array(path), path, episode, rate is None, notes)


def _unit_array(path: Path) -> Unit | None:
    """Return the unit in an array of text."""
    texts = [name for name, header in _headers(path).items() if name in ("unit", "units") and header.dtype.kind in "US"]
    return next((unit for name in texts if (unit := unit_of(str(_load(path, name))))), None)


def _matrices(path: Path) -> dict[str, tuple[str, int | None]]:
    """Return the array and layer of each episode."""
    headers = _headers(path)
    numbers = {name: header for name, header in headers.items() if header.dtype.kind in "fiu"}
    wide = {name: header for name, header in numbers.items() if len(header.shape) in (2, 3) and header.shape[-2] > 1}
    chosen = arrays.most_likely(wide) or [name for name in wide if not is_pose(name)]
    if not chosen:
        raise Unreadable(_without_joints(path, headers))
    found: dict[str, tuple[str, int | None]] = {}
    for name in chosen:
        layers = wide[name].shape[0] if len(wide[name].shape) == 3 else None
        if layers is None:
            found[name] = name, None
        else:
            found.update({f"{name}[{layer}]": (name, layer) for layer in range(layers)})
    return found


def _without_joints(path: Path, headers: dict[str, Header]) -> str:
    poses = [name for name in headers if is_pose(name)]
    listed = ", ".join(f"{name} {header.shape}" for name, header in headers.items()) or "nothing"
    if poses:
        return f"{path} {ONLY_POSES.format(', '.join(poses))}"
    if any(header.dtype.hasobject for header in headers.values()):
        return f"{path} has Python objects, which could run code and are not read; save arrays of numbers"
    if said := arrays.texts(headers) or arrays.too_short(headers):
        return f"{path}: {said}"
    return (
        f"{path} has no matrix samples × joints; it has {listed}; save joint positions with one row a sample and one "
        "column a joint"
    )


def _times(path: Path, array: str, samples: int, rate: float | None) -> np.ndarray | None:
    if rate is not None:
        return np.arange(samples) / rate
    headers = {name: header for name, header in _headers(path).items() if name != array}
    name = arrays.times_name(headers, samples)
    return None if name is None else arrays.scaled(name, _load(path, name))[0]


def _columns(path: Path, count: int) -> tuple[str, ...]:
    listed = {name: header for name, header in _headers(path).items() if header.shape == (count,)}
    for name in sorted(set(listed) & set(arrays.NAMES), key=arrays.NAMES.index):
        if listed[name].dtype.hasobject:
            raise Unreadable(
                f"{path}: {name} has Python objects, which could run code and are not read; save it as "
                f"np.array({name}, dtype=str)"
            )
        if listed[name].dtype.kind in "US":
            return tuple(text.decode() if isinstance(text, bytes) else str(text) for text in _load(path, name))
    return ()


def _headers(path: Path) -> dict[str, Header]:
    """Return shape and type of every array, without reading the data."""
    if _is_plain(path):
        with path.open("rb") as file:
            return {path.stem: _header(file)}
    with zipfile.ZipFile(path) as archive:
        members = [name for name in archive.namelist() if name.endswith(".npy")]
        found = {}
        for member in members:
            with archive.open(member) as file:
                found[member.removesuffix(".npy")] = _header(file)
        return found


def _header(file: IO[bytes]) -> Header:
    version = npy.read_magic(file)
    shape, _, dtype = HEADERS.get(version, npy.read_array_header_2_0)(file)
    return Header(shape, dtype)


def _load(path: Path, name: str) -> np.ndarray:
    loaded = np.load(path, allow_pickle=False)
    return loaded if isinstance(loaded, np.ndarray) else loaded[name]


def _is_plain(path: Path) -> bool:
    return head(path).startswith(npy.MAGIC_PREFIX)
