"""Polynomial trajectories: checked exactly, for all times, then sampled for the loop."""

from dataclasses import dataclass

import numpy as np

from motion.bernstein import bernstein, derivative, first_outside
from motion.limits import QUANTITIES
from motion.trajectory import Samples, Trajectory
from protocol import messages as m
from protocol.codec import bad_message, matrix
from robot.description import RobotConfig
from services.controller.ranges import TIGHT, led_back_ranges, led_back_ticks, limit_refusal, slack

JUMPS = ("positions", 1e-8), ("velocities", 1e-6), ("accelerations", 1e-4)
"""Rounding: the largest difference (rad, rad/s, rad/s²) between two pieces where they meet."""

ROUNDING = 1e-9
"""Rounding of a duration, ticks."""

NUMBERS_AT_ONCE = 1 << 16
"""Coefficients a numpy call handles at most: a longer call would delay the 1 kHz loop of the same process."""


def check_pieces(trajectory: m.Trajectory, pieces: m.Pieces, config: RobotConfig) -> Samples:
    """Return the motion sampled at every tick.

    Raises:
        Refusal: `bad_message` where the pieces are malformed, jump or do not end at rest; `limit` where they leave the
            robot's limits at any time.
    """
    motion = _read(pieces, config)
    _check_count(trajectory, motion, config)
    _check_end(motion)
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is outside
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


def _check_end(motion: Trajectory) -> None:
    if motion.coefficients[-1, :, 1:].any():
        sentence = "the last piece must be constant, for the arm stays where it ends; it may have no length"
        raise bad_message("pieces.coefficients", sentence)


def _check_joints(motion: Trajectory, config: RobotConfig) -> None:
    """Check that positions, velocities and accelerations are continuous where two pieces meet."""
    before, after = motion.coefficients[:-1], motion.coefficients[1:]
    lengths = np.diff(motion.breaks)[:-1, None]
    for name, tolerance in JUMPS:
        ends = np.polynomial.polynomial.polyval(lengths, before.transpose(2, 0, 1), tensor=False)
        gaps = after[:, :, 0] - ends
        jumps = ~(np.abs(gaps) <= tolerance)
        if jumps.any():
            piece, joint = np.argwhere(jumps)[0]
            sentence = (
                f"{name} of {config.joint_names[joint]} jump by {gaps[piece, joint]:.3g} at "
                f"{motion.breaks[piece + 1]:.6g} s, from piece {piece} to the next; they must go on there"
            )
            raise bad_message("pieces.coefficients", sentence)
        before, after = derivative(before), derivative(after)


def _check_limits(motion: Trajectory, hit_index: int, config: RobotConfig) -> None:
    """Check that all four quantities are inside the limits at all times."""
    begins, ends = motion.breaks[:-1], motion.breaks[1:]
    position, *others = zip(QUANTITIES, config.limits.ranges.transpose(1, 2, 0), strict=True)
    first, (low, high) = motion.coefficients[0, :, 0], position[1]
    outside = np.any((first < low) | (first > high))
    inside_from = led_back_ticks(hit_index) * config.tick if outside else 0.0
    part = begins < inside_from
    led_back = Span(part, begins, np.minimum(ends, inside_from))
    _check_range("position", motion, led_back, led_back_ranges(first, config.limits), config)
    part = ends >= inside_from
    _check_range("position", motion, Span(part, np.maximum(begins, inside_from), ends), (low, high), config)
    moved = motion
    for quantity, (low, high) in others:
        moved = Trajectory(motion.breaks, derivative(moved.coefficients))
        _check_range(quantity, moved, Span(np.full(len(begins), True), begins, ends), (low, high), config)


@dataclass(frozen=True, slots=True, eq=False)
class Span:
    """Which pieces (m,) are checked, and the begin and end of each check (m,), s from the start of the motion."""

    pieces: np.ndarray
    begins: np.ndarray
    ends: np.ndarray


def _check_range(
    quantity: str, motion: Trajectory, span: Span, bounds: tuple[np.ndarray, np.ndarray], config: RobotConfig
) -> None:
    low, high = bounds
    margin, joints = slack(low, high), config.joint_count
    chosen = np.flatnonzero(span.pieces)
    size = max(1, NUMBERS_AT_ONCE // motion.coefficients[0].size)
    for start in range(0, len(chosen), size):
        some = chosen[start : start + size]
        begins, ends = span.begins[some], span.ends[some]
        local = ((times - motion.breaks[some])[:, None] for times in (begins, ends))
        curves = bernstein(motion.coefficients[some], *local).reshape(len(some) * joints, -1)
        each = np.broadcast_to(np.stack([low - margin, high + margin])[:, None], (2, len(some), joints))
        found = first_outside(curves, *each.reshape(2, -1))
        if found is not None:
            piece, joint = divmod(found.curve, joints)
            when = begins[piece] + found.at * (ends[piece] - begins[piece])
            passed = float(low[joint]), float(high[joint])
            raise limit_refusal(quantity, joint, found.value, passed, f"{when:.6g} s", config)


def _sample(motion: Trajectory, count: int, config: RobotConfig) -> Samples:
    """Sample the motion at every tick; the last sample is at rest, even where rounding puts the last break after it."""
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
