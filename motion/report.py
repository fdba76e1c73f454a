"""What a plan promises, recomputed from its weights."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import simpson

from motion.basis import INTERVALS, Grid
from motion.limits import QUANTITIES
from motion.primitive import Primitive
from motion.problem import JointProblem
from motion.request import MotionRequest
from motion.solver import Solution
from motion.tail import Stop, stop_extremes


@dataclass(frozen=True, slots=True)
class Active:
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


def make_report(
    grid: Grid,
    primitive: Primitive,
    request: MotionRequest,
    weights: np.ndarray,
    problems: list[JointProblem],
    solutions: list[Solution],
    tail: Stop | None,
) -> Report:
    """The report of a plan with the weights (J, N)."""
    extremes = _extremes(request, solutions, tail)
    ranges = np.stack([request.limits.joint(joint) for joint in range(request.joint_count)])
    margin = np.minimum(extremes[:, :, 0] - ranges[:, :, 0], ranges[:, :, 1] - extremes[:, :, 1])
    error_positions, error_velocities = _final_errors(grid, request, weights)
    return Report(
        imitation_rms=_imitation_rms(grid, primitive, request, weights),
        final_error_positions=error_positions,
        final_error_velocities=error_velocities,
        extremes={name: extremes[:, k] for k, name in enumerate(QUANTITIES)},
        margin={name: margin[:, k] for k, name in enumerate(QUANTITIES)},
        active=tuple(a for p, s in zip(problems, solutions, strict=True) for a in _active(p, s)),
        certified=not any(solution.certificate.failures for solution in solutions),
        rounds=max(solution.rounds for solution in solutions),
        rows=max(solution.row_count for solution in solutions),
    )


def _imitation_rms(grid: Grid, primitive: Primitive, request: MotionRequest, weights: np.ndarray) -> np.ndarray:
    """Rms (J,) of g̈ − τ²d̈ with τ = T_d/T, over the whole duration; after the moving part g̈ = 0."""
    tau = primitive.duration / request.duration
    played = grid.basis.rows(grid.s, 0) @ weights.T / request.duration**2
    played[round(request.moving_fraction * INTERVALS) + 1 :] = 0.0
    return np.sqrt(simpson((played - tau**2 * primitive.accelerations) ** 2, x=grid.s, axis=0))


def _final_errors(grid: Grid, request: MotionRequest, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (J,) from the goal's position and velocity at the hit."""
    end, duration = request.moving_fraction, request.duration
    place = np.array([end])
    travelled, gained = (weights @ grid.basis.rows(place, order)[0] for order in (-2, -1))
    velocities = request.start.velocities + gained / duration
    positions = request.start.positions + end * duration * request.start.velocities + travelled
    positions = positions + (1 - end) * duration * velocities
    return np.abs(positions - request.goal.positions), np.abs(velocities - request.goal.velocities)


def _extremes(request: MotionRequest, solutions: list[Solution], tail: Stop | None) -> np.ndarray:
    """Lowest and highest values (J, 4, 2) over motion and tail."""
    extremes = np.stack([solution.certificate.extremes for solution in solutions])
    goal = request.goal

    def widen(quantity: int, low: np.ndarray, high: np.ndarray) -> None:
        extremes[:, quantity, 0] = np.minimum(extremes[:, quantity, 0], low)
        extremes[:, quantity, 1] = np.maximum(extremes[:, quantity, 1], high)

    widen(0, goal.positions, goal.positions)
    widen(1, goal.velocities, goal.velocities)
    if tail is not None:
        limits = request.limits
        accelerations = tail.states[2]
        p_min, p_max, v_min, v_max = stop_extremes(
            goal.positions, goal.velocities, accelerations[:, 0], limits.accelerations, limits.jerks
        )
        widen(0, p_min, p_max)
        widen(1, v_min, v_max)
        widen(2, accelerations.min(axis=1), accelerations.max(axis=1))
        played = np.diff(tail.knots, axis=1, append=tail.knots[:, -1:]) > 0
        jerks = np.where(played, tail.jerks, 0.0)
        widen(3, jerks.min(axis=1), jerks.max(axis=1))
    return extremes


def _active(problem: JointProblem, solution: Solution) -> list[Active]:
    """One entry for each stretch of neighbouring rows with multipliers, at the largest of them."""
    rows = solution.binding()
    if not rows.size:
        return []
    multipliers = solution.multipliers[np.searchsorted(solution.rows, rows)]
    # Peaks come with neighbours three samples away, so a gap wider than that starts another stretch.
    stretches = np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows) > 8) + 1)
    count = INTERVALS + 1
    found = [rows[k[multipliers[k].argmax()]] for k in stretches]
    return [
        Active(problem.joint, QUANTITIES[r // count], float(r % count / INTERVALS * problem.duration)) for r in found
    ]
