"""From a primitive and a request to a verified motion."""

import math
from dataclasses import dataclass

import numpy as np

from motion.basis import INTERVALS, Grid, make_grid
from motion.curve import interpolate
from motion.errors import Infeasible, InvalidMotion, SolverFailed
from motion.fixed import check_fixed, fixed_values
from motion.limits import QUANTITIES
from motion.primitive import Primitive
from motion.problem import Problem, build
from motion.report import Active, Report, make_report
from motion.request import MotionRequest
from motion.samples import Samples
from motion.shortest import shortest_duration
from motion.solver import Clash, Solution, solve
from motion.stopping import arriving, final_accelerations
from motion.tail import TOUCH, Stop, stop

__all__ = ["Active", "Plan", "Report", "Samples", "Warm", "plan"]

EQUALITY_TOLERANCE = 1e-10
"""Equalities hold to this part of the largest target, or it is no plan."""

ROUNDING = 4 * np.finfo(float).eps
"""… or to this part of the terms that make them up."""


@dataclass(frozen=True, slots=True)
class Warm:
    """A motion's curves (J, 6, M) in normalised time: the next plan of the same joints begins with the rows at which
    they come near its limits."""

    curves: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A verified motion: basis part, straight part (rest fraction), tail.

    weights: (J, N) of g″(s) (eq. 8 in normalised time). curves: (J, 6, 1001), position and its first five
    derivatives at s = 0, 0.001, … 1. duration: of the motion up to the hit, s.
    total_duration: with the tail, s, a multiple of `tick`. hit_index: the tick nearest to the hit. warm: for
    the next call. tail: the stop, None for "coast".
    """

    request: MotionRequest
    weights: np.ndarray
    curves: np.ndarray
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
        out[:, moving] = interpolate(self.curves, self.duration, times[moving])
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
    if warm is not None and len(warm.curves) != request.joint_count:
        raise InvalidMotion("warm", f"belongs to {len(warm.curves)} joints, not to {request.joint_count}")
    # A goal outside its limits is named as such, not as one from which no stop leads back inside.
    fixed = fixed_values(request)
    check_fixed(request, fixed)
    grid = make_grid(primitive.basis_count)
    try:
        problem = build(grid, request, fixed, primitive.theta, arriving(request))
        solutions = _solved(grid, problem, warm)
        tail, reach, stuck = _tail(request, solutions)
        if stuck.size:
            # Only now does it pay to ask which final accelerations leave room for the stop.
            problem = build(grid, request, fixed, primitive.theta, final_accelerations(request))
            again = _solved(grid, problem, Warm(_curves(solutions)), stuck)
            for joint, solution in zip(stuck.tolist(), again, strict=True):
                solutions[joint] = solution
            tail, reach, stuck = _tail(request, solutions)
    except Clash as clash:
        raise _infeasible(grid, primitive, request, tick, clash) from None
    if stuck.size:
        raise SolverFailed(int(stuck[0]), "the stop after the goal leaves the limits")
    normalised = _curves(solutions)
    curves = normalised * request.duration ** -np.arange(6.0)[:, None]
    total = request.duration + (tail.duration if tail else 0.0)
    return Plan(
        request=request,
        weights=grid.weights(np.array([solution.x for solution in solutions])),
        curves=curves,
        tail=tail,
        duration=request.duration,
        total_duration=math.ceil(total / tick - 1e-9) * tick,
        hit_index=round(request.duration / tick),
        tick=tick,
        report=make_report(primitive, request, solutions, curves, reach),
        warm=Warm(normalised),
    )


def _curves(solutions: list[Solution]) -> np.ndarray:
    """The curves (J, 6, M) of all joints in normalised time."""
    return np.array([solution.certificate.curves for solution in solutions])


def _solved(grid: Grid, problem: Problem, warm: Warm | None = None, joints: np.ndarray | None = None) -> list[Solution]:
    """The optimum, certified, of every joint or of the `joints` (n,). Raises Clash or SolverFailed.

    Rows of an earlier motion are demanded where this one might have done without, so no verdict rests on them.
    """
    if warm is not None:
        try:
            return _certified(grid, problem, warm, joints)
        except (Clash, SolverFailed):
            pass
    return _certified(grid, problem, None, joints)


def _certified(grid: Grid, problem: Problem, warm: Warm | None, joints: np.ndarray | None) -> list[Solution]:
    chosen = np.arange(len(problem.targets)) if joints is None else joints
    solutions = solve(grid, problem, warm.curves if warm else None, chosen)
    for joint, solution in zip(chosen.tolist(), solutions, strict=True):
        if solution.certificate.failures:
            failure = solution.certificate.failures[0]
            time = (failure.sample + 0.5) / grid.intervals * problem.duration
            raise SolverFailed(joint, f"no certificate for the {QUANTITIES[failure.quantity]} near {time:.3f} s")
    x = np.array([solution.x for solution in solutions])
    missed = np.abs(problem.equalities.missed(x, problem.targets, chosen))
    allowed = EQUALITY_TOLERANCE * np.maximum(1.0, np.abs(problem.targets[chosen]).max(axis=1))[:, None]
    if not (missed <= allowed).all():
        # Large weights that cancel each other, as in a motion that is over at once, leave their rounding.
        terms = np.abs(problem.equalities.rows[chosen]) @ np.abs(x)[:, :, None]
        allowed = np.maximum(allowed, ROUNDING * terms[:, :, 0])
    if not (missed <= allowed).all():
        joint = (missed / allowed).max(axis=1).argmax()
        raise SolverFailed(int(chosen[joint]), f"equalities are off by {missed[joint].max():.1e}")
    return solutions


def _infeasible(grid: Grid, primitive: Primitive, request: MotionRequest, tick: float, clash: Clash) -> Infeasible:
    """The answer to a request whose limits clash, with a duration that works if one is found.

    Raises CannotStop where none could, because the arm would not come to rest inside its limits.
    """
    confined = final_accelerations(request)

    def works(longer: MotionRequest) -> object:
        fixed = fixed_values(longer)
        check_fixed(longer, fixed)
        return _solved(grid, build(grid, longer, fixed, primitive.theta, confined))

    found = shortest_duration(request, works, tick)
    return Infeasible(
        clash.joint,
        QUANTITIES[clash.quantity],
        clash.s * request.duration,
        found.duration if found else None,
        [w.time_from_start for w in found.waypoints] if found else None,
    )


def _tail(request: MotionRequest, solutions: list[Solution]) -> tuple[Stop | None, np.ndarray, np.ndarray]:
    """The stop from the goal, the lowest and highest values (J, 4, 2) of all quantities from there on (none of the
    acceleration and jerk of an arm that coasts), and the joints (n,) in which they leave the limits."""
    goal, ranges = request.goal, request.limits.ranges
    if request.tail == "coast":
        free = np.full(request.joint_count, np.inf)
        state = goal.positions, goal.velocities
        return None, np.array([[*state, free, free], [*state, -free, -free]]).T, np.zeros(0, dtype=int)
    last = round(request.moving_fraction * INTERVALS)
    reached = np.array([solution.certificate.curves[2, last] for solution in solutions]) / request.duration**2
    given = request.final_accelerations
    tail = stop(goal.positions, goal.velocities, np.where(np.isnan(given), reached, given), request.limits)
    reach = tail.extremes()
    outside = (reach[:, :2, 0] < ranges[:, :2, 0] - TOUCH) | (reach[:, :2, 1] > ranges[:, :2, 1] + TOUCH)
    return tail, reach, np.flatnonzero(outside.any(axis=1))
