"""Find joint positions and times among the named arrays of NPZ and HDF5 files."""

import re
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from motion.demonstration import MIN_SAMPLES
from tools.recordings.clock import TIMES, UNITS, unit_of_steps
from tools.recordings.names import is_pose, words

POSITIONS = (
    "qpos", "joint_positions", "joint_position", "joint_pos", "joint_states", "joint_state", "joints", "positions",
    "position", "q", "state", "states",
)  # fmt: skip
"""Names of matrices of joint positions, the likeliest first; other words may precede and follow."""

NAMES = "joint_names", "joint_name", "joints", "columns", "names", "name", "labels"
"""Names of arrays and attributes that name the columns, the likeliest first."""

SIDES = frozenset({"vel", "velocity", "gripper", "sin", "cos", "target", "action", "command"})
"""Words of matrices with other quantities, or with a second form of the same."""


class Matrix(Protocol):
    """Properties of an array in either kind of file, before it is read."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        ...

    @property
    def dtype(self) -> np.dtype:
        """Type of the numbers."""
        ...


def most_likely(found: Mapping[str, object]) -> list[str]:
    """Return the names of joint positions, only of the likeliest kind."""
    ranks = {name: rank for name in found if (rank := _rank(name)) is not None}
    return [name for name, rank in ranks.items() if rank == min(ranks.values())]


def times_name(found: Mapping[str, Matrix], samples: int) -> str | None:
    """Return the name of an array with one time a sample."""
    for word in TIMES:
        for name, array in found.items():
            if word in words(name) and array.shape in ((samples,), (samples, 1)) and array.dtype.kind in "fiumM":
                return name
    return None


def too_short(found: Mapping[str, Matrix]) -> str | None:
    """Return a sentence about matrices that are joint positions by name or form, and have no movement; or None."""
    flat = {name: array for name, array in found.items() if array.dtype.kind in "fiu" and len(array.shape) in (2, 3)}
    short = {name: array for name, array in flat.items() if array.shape[-2] <= 1}
    if not (names := most_likely(short) or list(short)):
        return None
    shape = short[names[0]].shape
    samples = "1 sample" if shape[-2] else "0 samples"
    return f"{names[0]} has {samples}, {shape}; a movement needs at least {MIN_SAMPLES}"


def texts(found: Mapping[str, Matrix]) -> str | None:
    """Return a sentence about a matrix of joint positions that are text instead of numbers; or None."""
    written = {name: array for name, array in found.items() if array.dtype.kind in "SUO" and len(array.shape) in (2, 3)}
    if not (names := most_likely(written)):
        return None
    return f"{names[0]}, {written[names[0]].shape}, has text, not numbers; save it as an array of float"


def transposed(found: Mapping[str, Matrix], name: str, shape: tuple[int, ...]) -> str | None:
    """Return a sentence about a matrix with one column a sample, by an array of as many times; otherwise None."""
    rows, columns = shape[-2:]
    if (times := times_name(found, columns)) is None:
        return None
    return f"{name} is {rows} × {columns}, and {times} has {columns} times: save its transpose, one row a sample"


def scaled(name: str, times: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return times since the first, s, by the unit in their name or a plausible one, and the assumptions."""
    flat = np.asarray(times).reshape(-1)
    if flat.dtype.kind in "mM":
        return (flat - flat[:1]) / np.timedelta64(1, "ns") * 1e-9, ()
    rest = (flat - flat[0]).astype(float) if len(flat) else flat.astype(float)
    said = [UNITS[word] for word in words(name) if word in UNITS]
    unit = said[-1] if said else unit_of_steps(rest)
    note = () if said or unit == 1.0 else (f"{name} is taken to be in steps of {unit:g} s",)
    return rest * unit, note


def _rank(name: str) -> int | None:
    base = re.split(r"[/]", name)[-1].lower()
    parts = words(base)
    if set(parts) & SIDES or is_pose(base):
        return None
    for rank, known in enumerate(POSITIONS):
        if base == known or base.replace(".", "_").endswith(f"_{known}") or (known in base and len(known) > 5):
            return rank
    return None
