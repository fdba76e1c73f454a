"""HDF5: ALOHA's /observations/qpos, robomimic's data/demo_N/obs/…joint_pos, and other matrices with such names."""

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
"""Columns of ALOHA's qpos, which the file does not name; grippers are fractions of their opening."""

ROBOMIMIC_JOINTS = re.compile(r"robot\d+_joint_pos")
"""Joints of a robot of robomimic, which the file does not name; grippers have an array of their own."""

NOT_MEASURED = frozenset({"action", "actions", "next_obs"})
"""Parts of paths to matrices that are not measured positions."""


def episodes(path: Path, rate: float | None) -> list[Episode]:
    """Return the movements, in the natural order of their names."""
    with h5py.File(path, "r") as file:
        found = []
        for name, member in _named(_position_paths(file)).items():
            matrix = _matrix(file, member)
            check_size(path, name, len(matrix))
            times = _times(file, member, len(matrix), rate)
            found.append(Episode(name, len(matrix), None if times is None else float(times[0][-1] - times[0][0])))
        return found


def read(path: Path, episode: str, rate: float | None) -> Recording:
    """Return one movement."""
    with h5py.File(path, "r") as file:
        member = _named(_position_paths(file))[episode]
        matrix = _matrix(file, member)
        values = np.asarray(matrix[()], dtype=float)
        times = _times(file, member, len(values), rate)
        if times is None and (fault := _transposed(member, matrix)):
            raise Unreadable(f"{path}: {fault}")
        if times is None:
            raise Unreadable(f"{path} has no times for {member}; give --rate, in samples a second")
        stamps, stamped, notes = times
        unit = unit_of(member) or _unit_attribute(matrix)
        return Recording(stamps, _columns(file, matrix, member), values, unit, path, episode, stamped, notes)


def _position_paths(file: h5py.File) -> list[str]:
    """Return the paths of the matrices of joint positions. Links to other files are not followed."""
    found: dict[str, h5py.Dataset] = {}
    others: dict[str, h5py.Dataset] = {}

    def visit(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.ndim == 2:
            (found if item.dtype.kind in "fiu" else others)[name] = item

    file.visititems(visit)
    measured = {name: item for name, item in found.items() if not set(name.split("/")) & NOT_MEASURED}
    chosen = arrays.most_likely({name: item for name, item in measured.items() if len(item) > 1})
    if not chosen and (fault := arrays.too_short({name: measured[name] for name in arrays.most_likely(measured)})):
        raise Unreadable(f"{file.filename}: {fault}")
    if not chosen and (poses := [name for name in measured if is_pose(name)]):
        raise Unreadable(f"{file.filename} {ONLY_POSES.format(', '.join(poses[:3]))}")
    if not chosen and (fault := arrays.texts(others)):
        raise Unreadable(f"{file.filename}: {fault}")
    return sorted(chosen, key=_natural)


def _named(members: list[str]) -> dict[str, str]:
    """Return paths by short names: the numbered part of each path if these differ, otherwise the whole path."""
    demos = [next((part for part in member.split("/") if re.fullmatch(r"\w*?\d+", part)), "") for member in members]
    if all(demos) and len(set(demos)) == len(members):
        return dict(zip(demos, members, strict=True))
    return {member: member for member in members}


def _unit_attribute(matrix: h5py.Dataset) -> Unit | None:
    """Return the unit in an attribute of the matrix."""
    texts = [matrix.attrs[name] for name in ("unit", "units") if name in matrix.attrs]
    return next((unit for text in texts if isinstance(text, str) and (unit := unit_of(text))), None)


def _natural(member: str) -> list[tuple[int, str]]:
    """Return a key that sorts the numbers in paths by value."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", member)]


def _matrix(file: h5py.File, member: str) -> h5py.Dataset:
    matrix = file[member]
    assert isinstance(matrix, h5py.Dataset)
    return matrix


def _times(
    file: h5py.File, member: str, samples: int, rate: float | None
) -> tuple[np.ndarray, bool, tuple[str, ...]] | None:
    """Return times, whether the file has them, and assumptions; None for a file without times and rate."""
    if rate is not None:
        return np.arange(samples) / rate, False, ()
    for folder in PurePosixPath(member).parents:
        group = file[str(folder)] if str(folder) != "." else file
        assert isinstance(group, h5py.Group)
        datasets = {name: item for name, item in group.items() if isinstance(item, h5py.Dataset)}
        name = arrays.times_name(datasets, samples)
        if name is not None:
            stamps, notes = arrays.scaled(name, datasets[name][()])
            return stamps, True, notes
    return _from_rate(file, member, samples)


def _transposed(member: str, matrix: h5py.Dataset) -> str | None:
    """Return a sentence about a matrix with one column for each sample, found by the times in its group, or None."""
    group = matrix.parent
    assert isinstance(group, h5py.Group)
    datasets = {name: item for name, item in group.items() if isinstance(item, h5py.Dataset)}
    return arrays.transposed(datasets, member, matrix.shape)


def _from_rate(file: h5py.File, member: str, samples: int) -> tuple[np.ndarray, bool, tuple[str, ...]] | None:
    """Return times at the rate of ALOHA or robomimic, as `_times` does; None for other files."""
    if member == "observations/qpos":
        note = f"the file has no times; ALOHA records at {ALOHA_RATE_HZ:g} Hz, --rate sets another rate"
        return np.arange(samples) / ALOHA_RATE_HZ, False, (note,)
    data = file.get("data")
    text = data.attrs.get("env_args") if isinstance(data, h5py.Group) else None
    if isinstance(text, str):
        hertz = json.loads(text).get("env_kwargs", {}).get("control_freq")
        if isinstance(hertz, int | float) and hertz > 0:
            note = f"the file has no times; its env_args give {hertz:g} Hz, --rate sets another rate"
            return np.arange(samples) / hertz, False, (note,)
    return None


def _columns(file: h5py.File, matrix: h5py.Dataset, member: str) -> tuple[str, ...]:
    """Return the names in an attribute of the matrix, or in an attribute or array of a group that contains it."""
    for item in (matrix, *(file[str(folder)] for folder in PurePosixPath("/", member).parents)):
        for name in arrays.NAMES:
            names = item.attrs.get(name)
            dataset = item.get(name) if isinstance(item, h5py.Group) else None
            if names is None and isinstance(dataset, h5py.Dataset) and dataset.shape == matrix.shape[1:]:
                names = dataset[()]
            if isinstance(names, np.ndarray) and names.shape == matrix.shape[1:] and names.dtype.kind in "SUO":
                return tuple(text.decode() if isinstance(text, bytes) else str(text) for text in names)
    if ROBOMIMIC_JOINTS.fullmatch(PurePosixPath(member).name):
        return tuple(f"joint_{number}" for number in range(1, matrix.shape[1] + 1))
    return ALOHA_COLUMNS if member == "observations/qpos" and matrix.shape[1] == len(ALOHA_COLUMNS) else ()
