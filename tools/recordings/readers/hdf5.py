"""HDF5: ALOHA's /observations/qpos, robomimic's data/demo_N/obs/…joint_pos, and matrices of such names elsewhere."""

import json
import re
from pathlib import Path, PurePosixPath

import h5py
import numpy as np

from tools.recordings import arrays
from tools.recordings.names import ONLY_POSES, is_pose, unit_of
from tools.recordings.recording import Episode, Recording, Unit, Unreadable, check_size

ALOHA_RATE_HZ = 50.0
ALOHA_JOINTS = "waist", "shoulder", "elbow", "forearm_roll", "wrist_angle", "wrist_rotate", "gripper"
ALOHA_COLUMNS = tuple(f"{side}_{joint}" for side in ("left", "right") for joint in ALOHA_JOINTS)
"""Joints of ALOHA's qpos, which the file does not name; grippers are in parts of their opening."""


def episodes(path: Path, rate: float | None) -> list[Episode]:
    """Return the movements, in the natural order of their names."""
    with h5py.File(path, "r") as file:
        found = []
        for name, place in _named(_places(file)).items():
            matrix = _matrix(file, place)
            check_size(path, name, len(matrix))
            times = _times(file, place, len(matrix), rate)
            found.append(Episode(name, len(matrix), None if times is None else float(times[0][-1] - times[0][0])))
        return found


def read(path: Path, episode: str, rate: float | None) -> Recording:
    """Return one movement."""
    with h5py.File(path, "r") as file:
        place = _named(_places(file))[episode]
        matrix = _matrix(file, place)
        values = np.asarray(matrix[()], dtype=float)
        times = _times(file, place, len(values), rate)
        if times is None and (said := _transposed(place, matrix)):
            raise Unreadable(f"{path}: {said}")
        if times is None:
            raise Unreadable(f"{path} has no times for {place}; give --rate, in samples a second")
        stamps, stamped, notes = times
        unit = unit_of(place) or _said(matrix)
        return Recording(stamps, _columns(file, matrix, place), values, unit, path, episode, stamped, notes)


def _places(file: h5py.File) -> list[str]:
    """Return the paths of the matrices of joint positions. Links to other files are not followed."""
    found: dict[str, h5py.Dataset] = {}

    def visit(name: str, thing: object) -> None:
        if isinstance(thing, h5py.Dataset) and thing.ndim == 2 and thing.dtype.kind in "fiu":
            found[name] = thing

    file.visititems(visit)
    measured = {name: thing for name, thing in found.items() if not set(name.split("/")) & {"action", "actions"}}
    inside = {name: thing for name, thing in measured.items() if not {"next_obs"} & set(name.split("/"))}
    long = {name: thing for name, thing in inside.items() if len(thing) > 1}
    chosen = arrays.most_likely(long)
    if not chosen and (said := arrays.too_short({name: inside[name] for name in arrays.most_likely(inside)})):
        raise Unreadable(f"{file.filename}: {said}")
    if not chosen and (poses := [name for name in inside if is_pose(name)]):
        raise Unreadable(f"{file.filename} {ONLY_POSES.format(', '.join(poses[:3]))}")
    return sorted(chosen, key=_natural)


def _named(places: list[str]) -> dict[str, str]:
    """Return places by a short name: the part of the path that tells them apart."""
    demos = [next((part for part in place.split("/") if re.fullmatch(r"\w*?\d+", part)), "") for place in places]
    if all(demos) and len(set(demos)) == len(places):
        return dict(zip(demos, places, strict=True))
    return {place: place for place in places}


def _said(matrix: h5py.Dataset) -> Unit | None:
    """Return the unit in an attribute of the matrix."""
    texts = [matrix.attrs[name] for name in ("unit", "units") if name in matrix.attrs]
    return next((unit for text in texts if isinstance(text, str) and (unit := unit_of(text))), None)


def _natural(place: str) -> list[tuple[int, str]]:
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", place)]


def _matrix(file: h5py.File, place: str) -> h5py.Dataset:
    matrix = file[place]
    assert isinstance(matrix, h5py.Dataset)
    return matrix


def _times(
    file: h5py.File, place: str, samples: int, rate: float | None
) -> tuple[np.ndarray, bool, tuple[str, ...]] | None:
    """Return times, whether the file has them, and what was assumed; None where nothing is known."""
    if rate is not None:
        return np.arange(samples) / rate, False, ()
    for folder in PurePosixPath(place).parents:
        group = file[str(folder)] if str(folder) != "." else file
        assert isinstance(group, h5py.Group)
        beside = {name: thing for name, thing in group.items() if isinstance(thing, h5py.Dataset)}
        name = arrays.times_name(beside, samples)
        if name is not None:
            stamps, notes = arrays.scaled(name, beside[name][()])
            return stamps, True, notes
    return _from_rate(file, place, samples)


def _transposed(place: str, matrix: h5py.Dataset) -> str | None:
    """Return a sentence about a matrix with one column a sample, by the times beside it; otherwise None."""
    group = matrix.parent
    assert isinstance(group, h5py.Group)
    beside = {name: thing for name, thing in group.items() if isinstance(thing, h5py.Dataset)}
    return arrays.transposed(beside, place, matrix.shape)


def _from_rate(file: h5py.File, place: str, samples: int) -> tuple[np.ndarray, bool, tuple[str, ...]] | None:
    if place == "observations/qpos":
        note = f"the file has no times; ALOHA records at {ALOHA_RATE_HZ:g} Hz, --rate says another"
        return np.arange(samples) / ALOHA_RATE_HZ, False, (note,)
    data = file.get("data")
    text = data.attrs.get("env_args") if isinstance(data, h5py.Group) else None
    if isinstance(text, str):
        hertz = json.loads(text).get("env_kwargs", {}).get("control_freq")
        if isinstance(hertz, int | float) and hertz > 0:
            note = f"the file has no times; its env_args say {hertz:g} Hz, --rate says another"
            return np.arange(samples) / hertz, False, (note,)
    return None


def _columns(file: h5py.File, matrix: h5py.Dataset, place: str) -> tuple[str, ...]:
    """Return the names in an attribute of the matrix, or in an attribute or array beside it or above it."""
    for thing in (matrix, *(file[str(folder)] for folder in PurePosixPath("/", place).parents)):
        for name in arrays.NAMES:
            names = thing.attrs.get(name)
            beside = thing.get(name) if isinstance(thing, h5py.Group) else None
            if names is None and isinstance(beside, h5py.Dataset) and beside.shape == matrix.shape[1:]:
                names = beside[()]
            if isinstance(names, np.ndarray) and names.shape == matrix.shape[1:] and names.dtype.kind in "SUO":
                return tuple(text.decode() if isinstance(text, bytes) else str(text) for text in names)
    return ALOHA_COLUMNS if place == "observations/qpos" and matrix.shape[1] == len(ALOHA_COLUMNS) else ()
