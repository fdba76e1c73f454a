"""What a plan promises, recomputed from its weights."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motion.basis import INTERVALS
from motion.limits import QUANTITIES
from motion.primitive import Primitive
from motion.request import MotionRequest
from motion.solver import Solution


class Active(NamedTuple):
    """A limit that shapes the motion: its row carries a multiplier at `time_from_start` (s)."""

    joint: int
    quantity: str
    time_from_start: float


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """What a plan promises, recomputed from its weights, J joints.

    imitation_rms: (J,) rms of g̈ − τ²d̈ over the motion, rad/s². final_error_*: (J,) distance from the goal at
    the hit. extremes: per quantity (J, 2), lowest and highest over all t, tail included. margin: per quantity
    (J,), the smallest distance to the limit, inf where there is none. active: what shapes the motion.
    certified: the limits were shown to hold at every time. rounds, rows: the most of any joint.
    """

    imitation_rms: np.ndarray
    final_error_positions: np.ndarray
    final_error_velocities: np.ndarray
    extremes: dict[str, np.ndarray]
    margin: dict[str, np.ndarray]
    active: tuple[Active, ...]
    certified: bool
    rounds: int
    rows: int


APART = 8
"""Rows farther apart than this many samples belong to different stretches: peaks and plateaus bring rows three to six
apart."""

_SIMPSON = np.array([1.0, *[4.0, 2.0] * (INTERVALS // 2 - 1), 4.0, 1.0]) / (3 * INTERVALS)


def make_report(
    primitive: Primitive,
    request: MotionRequest,
    solutions: list[Solution],
    curves: np.ndarray,
    reach: np.ndarray,
) -> Report:
    """The report of a plan: `curves` (J, 6, M) its derivatives on the grid, `reach` (J, 4, 2) the lowest and highest
    values from the goal on."""
    extremes = _extremes(request, solutions, reach)
    ranges = request.limits.ranges
    margin = np.minimum(extremes[:, :, 0] - ranges[:, :, 0], ranges[:, :, 1] - extremes[:, :, 1])
    error_positions, error_velocities = _final_errors(request, curves)
    return Report(
        imitation_rms=_imitation_rms(primitive, request, curves[:, 2]),
        final_error_positions=error_positions,
        final_error_velocities=error_velocities,
        extremes={name: extremes[:, k] for k, name in enumerate(QUANTITIES)},
        margin={name: margin[:, k] for k, name in enumerate(QUANTITIES)},
        active=_active(request.duration, solutions),
        certified=not any(solution.certificate.failures for solution in solutions),
        rounds=max(solution.rounds for solution in solutions),
        rows=max(len(solution.rows) for solution in solutions),
    )


def _imitation_rms(primitive: Primitive, request: MotionRequest, accelerations: np.ndarray) -> np.ndarray:
    """Rms (J,) of g̈ − τ²d̈ with τ = T_d/T, over the whole duration; after the moving part g̈ = 0."""
    tau = primitive.duration / request.duration
    moving = slice(round(request.moving_fraction * INTERVALS) + 1)
    missed = tau**2 * primitive.accelerations.T
    missed[:, moving] -= accelerations[:, moving]
    return np.sqrt(missed**2 @ _SIMPSON)


def _final_errors(request: MotionRequest, curves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (J,) from the goal's position and velocity at the hit."""
    end = request.moving_fraction
    positions, velocities = curves[:, :2, round(end * INTERVALS)].T
    positions = positions + (1 - end) * request.duration * velocities
    return np.abs(positions - request.goal.positions), np.abs(velocities - request.goal.velocities)


def _extremes(request: MotionRequest, solutions: list[Solution], reach: np.ndarray) -> np.ndarray:
    """Lowest and highest values (J, 4, 2) over the motion and what comes after it."""
    extremes = np.array([solution.certificate.extremes for solution in solutions])
    extremes *= request.duration ** -np.arange(4.0)[:, None]
    np.minimum(extremes[..., 0], reach[..., 0], out=extremes[..., 0])
    np.maximum(extremes[..., 1], reach[..., 1], out=extremes[..., 1])
    return extremes


def _active(duration: float, solutions: list[Solution]) -> tuple[Active, ...]:
    """One entry for each stretch of neighbouring rows with multipliers, at the largest of them."""
    found: list[tuple[int, int]] = []
    for joint, solution in enumerate(solutions):
        binding = solution.binding()
        previous, largest = -APART - 1, 0.0
        for row, multiplier in zip(
            solution.rows[binding].tolist(), solution.multipliers[binding].tolist(), strict=True
        ):
            if row - previous > APART:
                found.append((joint, row))
                largest = multiplier
            elif multiplier > largest:
                found[-1], largest = (joint, row), multiplier
            previous = row
    count = INTERVALS + 1
    return tuple(Active(j, QUANTITIES[row // count % 4], row % count / INTERVALS * duration) for j, row in found)
