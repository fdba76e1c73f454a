"""From a primitive and a request to a verified motion."""

import math
from dataclasses import dataclass

import numpy as np

from motion.basis import Grid, make_grid
from motion.errors import Infeasible, InvalidMotion, SolverFailed
from motion.limits import QUANTITIES
from motion.primitive import Primitive
from motion.problem import JointProblem, build, check_fixed, fixed_values
from motion.report import Active, Report, make_report
from motion.request import MotionRequest
from motion.samples import Samples
from motion.shortest import shortest_duration
from motion.solver import Clash, Solution, solve
from motion.stopping import final_accelerations
from motion.tail import Stop, stop, stops_inside

__all__ = ["Active", "Plan", "Report", "Samples", "Warm", "plan"]

EQUALITY_TOLERANCE = 1e-10
"""Equalities hold to this part of the largest target, or it is no plan."""


@dataclass(frozen=True, slots=True)
class Warm:
    """Rows that carried multipliers, per joint: a start for the next plan of the same joints."""

    rows: tuple[np.ndarray, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A verified motion: basis part, straight part (rest fraction), tail.

    weights: (J, N) of g″(s) (eq. 8 in normalised time). duration: of the motion up to the hit, s.
    total_duration: with the tail, s, a multiple of `tick`. hit_index: the tick nearest to the hit. warm: for
    the next call. tail: the stop, None for "coast".
    """

    request: MotionRequest
    weights: np.ndarray
    tail: Stop | None
    duration: float
    total_duration: float
    hit_index: int
    tick: float
    report: Report
    warm: Warm

    def sample(self, times: np.ndarray) -> Samples:
        """States at `times` (n,), s from the start; beyond the end the arm rests (or coasts)."""
        times = np.asarray(times, dtype=float)
        request = self.request
        end = request.moving_duration
        out = np.empty((3, len(times), request.joint_count))
        moving = times <= end
        out[:, moving] = self._moving(times[moving])
        after = times[~moving] - self.duration
        goal = request.goal
        out[0, ~moving] = goal.positions + after[:, None] * goal.velocities
        out[1, ~moving] = goal.velocities
        out[2, ~moving] = 0.0
        if self.tail is not None:
            stopping = times > self.duration - 1e-9  # at the goal itself too: there an arm at rest is exactly at rest
            states = self.tail.sample(np.maximum(times[stopping] - self.duration, 0.0))
            out[:, stopping] = states.positions, states.velocities, states.accelerations
        return Samples(*out)

    def samples(self) -> Samples:
        """States on the tick grid, the first at 0, the last at `total_duration` (with a tail "stop" at rest)."""
        count = round(self.total_duration / self.tick)
        return self.sample(np.arange(count + 1) * self.tick)

    def _moving(self, times: np.ndarray) -> np.ndarray:
        """Eq. 9 in normalised time: (3, n, J)."""
        start, duration = self.request.start, self.duration
        s = times / duration
        basis = make_grid(self.weights.shape[1]).basis
        out = np.empty((3, len(times), len(self.weights)))
        for order in range(3):
            out[order] = basis.rows(s, order - 2) @ self.weights.T / duration**order
        out[0] += start.positions + times[:, None] * start.velocities
        out[1] += start.velocities
        return out


def plan(primitive: Primitive, request: MotionRequest, tick: float = 0.001, warm: Warm | None = None) -> Plan:
    """Plan the motion that imitates `primitive` best as `request` asks (eq. 10–17).

    `tick` (s) is the grid of the total duration; `warm` comes from an earlier plan of the same joints. Raises
    InvalidMotion, LimitExceeded, CannotStop, Infeasible (with the shortest duration found to work) or
    SolverFailed. What is returned was verified from its weights.
    """
    if primitive.joint_count != request.joint_count:
        raise InvalidMotion(
            "primitive",
            f"moves {primitive.joint_count} joints, the request {request.joint_count}; both have to agree",
        )
    if warm is not None and len(warm.rows) != request.joint_count:
        raise InvalidMotion("warm", f"belongs to {len(warm.rows)} joints, not to {request.joint_count}")
    # A goal outside its limits is named as such, not as one from which no stop leads back inside.
    for joint, acceleration in enumerate(request.final_accelerations()):
        check_fixed(fixed_values(request, joint, acceleration), request.limits.joint(joint), joint)
    grid = make_grid(primitive.basis_count)
    confined = final_accelerations(request)
    try:
        problems, solutions = _solve_joints(grid, primitive, request, confined, warm)
    except Clash as clash:
        raise _infeasible(grid, primitive, request, confined, tick, clash) from None
    return _assemble(grid, primitive, request, tick, problems, solutions)


def _solve_joints(
    grid: Grid, primitive: Primitive, request: MotionRequest, confined: np.ndarray, warm: Warm | None
) -> tuple[list[JointProblem], list[Solution]]:
    """All problems are built before the first is solved, so that a value outside the limits is named first."""
    problems = [build(grid, request, joint, confined[joint]) for joint in range(request.joint_count)]
    targets = grid.whiten(primitive.theta.T)
    return problems, [
        solve(grid, problem, targets[:, joint], warm.rows[joint] if warm else None)
        for joint, problem in enumerate(problems)
    ]


def _infeasible(
    grid: Grid,
    primitive: Primitive,
    request: MotionRequest,
    confined: np.ndarray,
    tick: float,
    clash: Clash,
) -> Infeasible:
    """The answer to a request whose limits clash, with a duration that works if one is found."""

    def works(longer: MotionRequest) -> bool:
        _solve_joints(grid, primitive, longer, confined, None)
        return True

    found = shortest_duration(request, works, tick)
    return Infeasible(
        clash.joint,
        QUANTITIES[clash.quantity],
        clash.s * request.duration,
        found.duration if found else None,
        [w.time_from_start for w in found.waypoints] if found else None,
    )


def _assemble(
    grid: Grid,
    primitive: Primitive,
    request: MotionRequest,
    tick: float,
    problems: list[JointProblem],
    solutions: list[Solution],
) -> Plan:
    """The plan of solved joints, after its equalities and its tail were looked at once more."""
    for problem, solution in zip(problems, solutions, strict=True):
        residual = np.abs(problem.equalities @ solution.z - problem.targets).max()
        if not residual <= EQUALITY_TOLERANCE * max(1.0, np.abs(problem.targets).max()):
            raise SolverFailed(problem.joint, f"equalities are off by {residual:.1e}")
    weights = grid.weights(np.stack([solution.z for solution in solutions], axis=1)).T
    tail = _tail(grid, request, weights) if request.tail == "stop" else None
    total = request.duration + (tail.duration if tail else 0.0)
    return Plan(
        request=request,
        weights=weights,
        tail=tail,
        duration=request.duration,
        total_duration=math.ceil(total / tick - 1e-9) * tick,
        hit_index=round(request.duration / tick),
        tick=tick,
        report=make_report(grid, primitive, request, weights, problems, solutions, tail),
        warm=Warm(tuple(solution.binding() for solution in solutions)),
    )


def _tail(grid: Grid, request: MotionRequest, weights: np.ndarray) -> Stop:
    """The stop from the goal. Raises SolverFailed should it leave the limits after all."""
    end = request.moving_fraction
    given = request.final_accelerations()
    free = weights @ grid.basis.rows(np.array([end]), 0)[0] / request.duration**2
    accelerations = np.where(np.isnan(given), free, given)
    goal = request.goal
    inside = stops_inside(goal.positions, goal.velocities, accelerations, request.limits)
    if not inside.all():
        raise SolverFailed(int(np.argmin(inside)), "the stop after the goal leaves the limits")
    return stop(goal.positions, goal.velocities, accelerations, request.limits)
