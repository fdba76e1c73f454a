"""Check polynomial trajectories exactly, for all times, and sample them for the loop."""

import math
from collections.abc import Iterable

import numpy as np

from motion.bernstein import bernstein, derivative, first_outside
from motion.limits import QUANTITIES
from motion.trajectory import Samples, Trajectory
from protocol import messages as m
from protocol.codec import bad_message, matrix
from robot.conversions import QUANTITY_OF, unit_of
from robot.description import RobotConfig
from services.controller.ranges import TIGHT, limit_refusal, return_ranges, return_ticks, slack

JUMPS = ("positions", 1e-8), ("velocities", 1e-6), ("accelerations", 1e-4)
"""Tolerance for rounding: largest jump (rad, rad/s, rad/s²) between two pieces, or between the end and rest."""

ROUNDING = 1e-9
"""Tolerance for the rounding of a duration, ticks."""

NUMBERS_AT_ONCE = 1 << 16
"""Largest number of coefficients in a numpy call; a longer call would delay the 1 kHz loop of this process."""


def check_pieces(trajectory: m.Trajectory, pieces: m.Pieces, config: RobotConfig) -> Samples:
    """Return the motion sampled at every tick.

    Raises:
        Refusal: `bad_message` if the pieces are malformed, jump or do not end at rest; `limit` if they exceed the
            robot's limits at any time.
    """
    motion = _read(pieces, config)
    _check_count(trajectory, motion, config)
    with np.errstate(over="ignore", invalid="ignore"):  # an overflow is outside all limits
        motion = _with_rest(motion, config)
        _check_joints(motion, config)
        _check_limits(motion, trajectory.hit_index, config)
    return _sample(motion, trajectory.count, config)


def _read(pieces: m.Pieces, config: RobotConfig) -> Trajectory:
    breaks, joints = np.array(pieces.breaks, dtype=float), config.joint_count
    count = len(breaks) - 1
    if count < 1:
        raise bad_message("pieces.breaks", f"pieces.breaks has {len(breaks)} entries; one more than pieces are needed")
    if breaks[0] != 0:
        raise bad_message("pieces.breaks", f"pieces.breaks[0] is {breaks[0]}; the first piece begins at 0")
    falling = np.flatnonzero(np.diff(breaks) < 0)
    if falling.size:
        after = int(falling[0]) + 1
        sentence = f"pieces.breaks[{after}] is {breaks[after]} after {breaks[after - 1]} s; breaks must not decrease"
        raise bad_message("pieces.breaks", sentence)
    rows = matrix(pieces.coefficients, count, joints * m.COEFFICIENTS, "pieces.coefficients")
    return Trajectory(breaks, rows.reshape(count, joints, m.COEFFICIENTS))


def _check_count(trajectory: m.Trajectory, motion: Trajectory, config: RobotConfig) -> None:
    ticks = motion.duration * config.rate_hz
    if not ticks - TIGHT <= trajectory.count - 1 < ticks + 1 - ROUNDING:
        wanted = f"pieces that end at {motion.duration} s take {np.ceil(ticks - TIGHT) + 1:.0f} samples"
        raise bad_message("count", f"count is {trajectory.count}; {wanted}, the last one at or after their end")


def _with_rest(motion: Trajectory, config: RobotConfig) -> Trajectory:
    """Return the motion with a constant last piece, which is added if the last one ends at rest."""
    if not motion.coefficients[-1, :, 1:].any():
        return motion
    positions, *rates = np.matmul(motion.coefficients[-1], _rows(np.diff(motion.breaks)[-1:])[0]).T
    check_rest(rates, config, "pieces.coefficients")
    rest = np.zeros((1, *motion.coefficients.shape[1:]))
    rest[0, :, 0] = positions
    return Trajectory(np.append(motion.breaks, motion.breaks[-1]), np.concatenate([motion.coefficients, rest]))


def check_rest(rates: Iterable[np.ndarray], config: RobotConfig, field: str = "") -> None:
    """Check that the velocities and accelerations (J,) at the end of a motion are zero within rounding.

    field: named by the refusal; by default the quantity.

    Raises:
        Refusal: `bad_message`, naming the joint that moves most.
    """
    for (name, tolerance), values in zip(JUMPS[1:], rates, strict=True):
        joint = int(np.abs(values).argmax())
        if not abs(values[joint]) <= tolerance:  # also for NaN
            unit = unit_of(QUANTITY_OF[name], config.slides[joint])
            sentence = f"{name} of {config.joint_names[joint]} end at {values[joint]:.3g} {unit}"
            raise bad_message(field or name, f"{sentence}; the motion must end at rest, its stop included")


def _rows(lengths: np.ndarray) -> np.ndarray:
    """Return the rows that give the states at the ends of pieces of these `lengths` (n,), s, for each derivative."""
    powers = lengths[:, None] ** np.arange(m.COEFFICIENTS)
    rows = np.zeros((len(powers), m.COEFFICIENTS, len(JUMPS)))
    for order in range(len(JUMPS)):
        rows[:, order:, order] = powers[:, : m.COEFFICIENTS - order] * _FACTORS[order, order:]
    return rows


def _check_joints(motion: Trajectory, config: RobotConfig) -> None:
    """Check that positions, velocities and accelerations are continuous where two pieces meet."""
    rows = _rows(np.diff(motion.breaks)[:-1])
    gaps = motion.coefficients[1:, :, : len(JUMPS)] * np.diagonal(_FACTORS) - np.matmul(motion.coefficients[:-1], rows)
    jumps = ~(np.abs(gaps) <= [tolerance for _, tolerance in JUMPS])
    if jumps.any():
        piece, joint, order = np.argwhere(jumps)[0]
        unit = unit_of(QUANTITIES[order], config.slides[joint])
        sentence = (
            f"{JUMPS[order][0]} of {config.joint_names[joint]} jump by {gaps[piece, joint, order]:.3g} {unit} at "
            f"{motion.breaks[piece + 1]:.6g} s, from piece {piece} to the next; they must go on there"
        )
        raise bad_message("pieces.coefficients", sentence)


_FACTORS = np.array([[math.perm(power, order) for power in range(m.COEFFICIENTS)] for order in range(len(JUMPS))])
"""Factor of each power's coefficient in the derivative of each order."""


def _check_limits(motion: Trajectory, hit_index: int, config: RobotConfig) -> None:
    """Check that all four quantities are inside the limits at all times."""
    begins, ends, ranges = motion.breaks[:-1], motion.breaks[1:], config.limits.ranges
    first, (low, high) = motion.coefficients[0, :, 0], config.limits.positions.T
    inside_from = 0.0
    if np.any((first < low) | (first > high)):
        inside_from = return_ticks(hit_index) * config.tick
        returning = ranges.copy()
        returning[:, 0] = np.stack(return_ranges(first, config.limits), axis=1)
        _check_ranges(motion, begins, np.minimum(ends, inside_from), returning, config)
    _check_ranges(motion, np.maximum(begins, inside_from), ends, ranges, config)


def _check_ranges(
    motion: Trajectory, begins: np.ndarray, ends: np.ndarray, ranges: np.ndarray, config: RobotConfig
) -> None:
    """Check that all quantities are inside their `ranges` (J, 4, 2).

    Each piece is checked from its time in `begins` to that in `ends` (m,), s; not at all if it ends before it begins.
    """
    low, high = ranges.transpose(2, 1, 0)
    margin, chosen = slack(low, high), np.flatnonzero(begins <= ends)
    bounds = np.stack([low - margin, high + margin])[:, :, None]
    size = max(1, NUMBERS_AT_ONCE // (motion.coefficients[0].size * len(QUANTITIES)))
    for start in range(0, len(chosen), size):
        some = chosen[start : start + size]
        first, last = begins[some], ends[some]
        quantities = np.zeros((len(QUANTITIES), len(some), *motion.coefficients.shape[1:]))
        quantities[0] = motion.coefficients[some]
        for order in range(1, len(QUANTITIES)):
            quantities[order, ..., :-1] = derivative(quantities[order - 1])
        curves = bernstein(quantities, *((times - motion.breaks[some])[:, None] for times in (first, last)))
        each = np.broadcast_to(bounds, (2, *curves.shape[:-1])).reshape(2, -1)
        found = first_outside(curves.reshape(-1, m.COEFFICIENTS), *each)
        if found is not None:
            order, piece, joint = np.unravel_index(found.curve, curves.shape[:-1])
            when = first[piece] + found.at * (last[piece] - first[piece])
            passed = float(low[order, joint]), float(high[order, joint])
            raise limit_refusal(QUANTITIES[order], int(joint), found.value, passed, f"{when:.6g} s", config)


def _sample(motion: Trajectory, count: int, config: RobotConfig) -> Samples:
    """Sample the motion at every tick; the last sample is at rest, even if rounding puts the last break after it."""
    times = np.arange(count) * config.tick
    times[-1] = max(times[-1], motion.duration)
    size = max(1, NUMBERS_AT_ONCE // motion.coefficients[0].size)
    fields = "positions", "velocities", "accelerations"
    matrices = {field: np.empty((count, config.joint_count)) for field in fields}
    for first in range(0, count, size):
        some = motion.sample(times[first : first + size])
        for field, values in matrices.items():
            values[first : first + size] = getattr(some, field)
    return Samples(**matrices)
