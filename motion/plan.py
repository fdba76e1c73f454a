"""From a primitive and a request to a verified motion."""

import math
from dataclasses import dataclass

import numpy as np

from motion import splines
from motion.braking import TOUCH, fastest_stop
from motion.errors import Infeasible, InvalidMotion, LimitExceeded, SolverFailed
from motion.limits import QUANTITIES
from motion.primitive import Primitive
from motion.program.constraint_generation import InfeasibleRows, Solution, solve
from motion.program.effort import Effort
from motion.program.equalities import Fixed, check_fixed, fixed_values
from motion.program.min_duration import FACTOR, MAX_DURATION, FirstFailing, min_duration, stretched
from motion.program.problem import FINEST, USUAL, Precision, Problem, build
from motion.program.report import Active, Report, make_report
from motion.program.terminal_set import arriving, final_accelerations
from motion.request import MotionRequest
from motion.trajectory import COEFFICIENTS, Samples, Trajectory

__all__ = ["Active", "Plan", "Report", "Samples", "Warm", "plan", "plan_fastest"]

EFFORT = 15_000.0
"""Of a plan of up to six joints, more in proportion; see `motion.program.effort`."""

USUAL_SHARE = 0.4
"""Part of the effort that the usual precision may take; what is left is for the finest and for another duration."""

PROBE = 800.0
"""The effort after which a joint counts as one that does not work in the duration that is tried."""

EQUALITY_TOLERANCE = 1e-10
"""Equalities hold to this part of the largest target, or it is no plan …"""

ROUNDING = 4 * np.finfo(float).eps
"""… or to this part of the terms that make them up."""


@dataclass(frozen=True, slots=True, eq=False)
class Warm:
    """The rows of a plan that came near their limits, an array for each joint: the next plan of the same joints begins
    with them. They belong to hulls with `points` control points."""

    points: int
    rows: list[np.ndarray]


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A verified motion: a spline up to the goal, a straight part if asked for, and a stop.

    control_points (J, N + 2): of the position over the moving part, rad. trajectory: all of it. duration: up to the
    hit, s. total_duration: with the stop, s, a multiple of `tick`. hit_index: the tick nearest to the hit. warm: for
    the next call.
    """

    request: MotionRequest
    control_points: np.ndarray
    trajectory: Trajectory
    duration: float
    total_duration: float
    hit_index: int
    tick: float
    report: Report
    warm: Warm

    def sample(self, times: np.ndarray) -> Samples:
        """States at `times` (n,), s from the start; beyond the end the arm rests (or coasts)."""
        return self.trajectory.sample(times)

    def samples(self) -> Samples:
        """States on the tick grid, the first at 0, the last at `total_duration` (with a tail "stop" at rest)."""
        count = round(self.total_duration / self.tick)
        return self.sample(np.arange(count + 1) * self.tick)


def plan(
    primitive: Primitive,
    request: MotionRequest,
    tick: float = 0.001,
    warm: Warm | None = None,
    remedy: bool = True,
    effort: Effort | None = None,
) -> Plan:
    """Plan the motion that imitates `primitive` best as `request` asks (eq. 10–17).

    `tick` (s) is the grid of the total duration; `warm` comes from an earlier plan of the same joints; `remedy`: what
    is infeasible is answered with a duration that works; `effort`: what may be spent. Raises InvalidMotion,
    LimitExceeded, CannotStop, Infeasible or SolverFailed. What is returned was verified from its weights.
    """
    _check_joints(primitive, request, warm)
    request = request.clipped()
    # A goal outside its limits is named as such, not as one from which no stop leads back inside.
    fixed = fixed_values(request)
    check_fixed(request, fixed)
    effort = effort or effort_for(request.joint_count)
    usual = effort.share(USUAL_SHARE * effort.left)
    try:
        return _planned(primitive, request, fixed, tick, warm, usual, USUAL)
    except (InfeasibleRows, SolverFailed) as failure:
        failed = failure
    effort.give_back(usual)
    finest = effort.share(effort.left / 4)
    try:
        return _planned(primitive, request, fixed, tick, None, finest, FINEST)
    except InfeasibleRows as failure:
        failed = failure
    except SolverFailed:
        pass
    effort.give_back(finest)
    raise _refusal(primitive, request, tick, failed, effort, remedy) from None


def effort_for(joints: int) -> Effort:
    """Return what a plan of so many joints may take."""
    return Effort(EFFORT * max(1.0, joints / 6))


def plan_fastest(primitive: Primitive, request: MotionRequest, tick: float = 0.001) -> Plan:
    """Plan as `plan` does in the shortest duration, a multiple of `tick`, that was found to keep the limits.

    Raises what `plan` raises; where no duration works, for the
    longest.
    """
    _check_joints(primitive, request, None)
    request, effort = request.clipped(), effort_for(request.joint_count)
    first_failing = _first_failing(primitive, final_accelerations(request), effort)
    found = min_duration(request, first_failing, 0, round(primitive.duration / tick), tick)
    return plan(primitive, found or stretched(request, MAX_DURATION), tick)


def _check_joints(primitive: Primitive, request: MotionRequest, warm: Warm | None) -> None:
    joints = request.joint_count
    if primitive.joint_count != joints:
        sentence = f"moves {primitive.joint_count} joints, the request {joints}; both must agree"
        raise InvalidMotion("primitive", sentence)
    if warm is not None and len(warm.rows) != joints:
        raise InvalidMotion("warm", f"belongs to {len(warm.rows)} joints, not to {joints}")


def _planned(
    primitive: Primitive,
    request: MotionRequest,
    fixed: Fixed,
    tick: float,
    warm: Warm | None,
    effort: Effort,
    precision: Precision,
) -> Plan:
    """The plan with a precision. Raises InfeasibleRows where there is none."""
    problem = build(primitive, request, fixed, arriving(request), precision)
    solutions = _solved(problem, effort, warm)
    points, tail, reach, stuck = _stopped(request, problem, solutions)
    if stuck.size:
        # Only now does it pay to ask which final accelerations leave room for the stop.
        problem = build(primitive, request, fixed, final_accelerations(request), precision)
        begin = Warm(len(problem.hull.s), [solution.rows for solution in solutions])
        for solution in _solved(problem, effort, begin, stuck):
            solutions[solution.joint] = solution
        points, tail, reach, stuck = _stopped(request, problem, solutions)
    if stuck.size:
        raise SolverFailed(int(stuck[0]), "the stop after the goal leaves the limits")
    pieces = splines.pieces(points)
    breaks = np.linspace(0.0, problem.duration, len(pieces) + 1)
    spline = Trajectory(breaks, pieces * problem.duration ** -np.arange(float(COEFFICIENTS)))
    total = problem.duration + tail.duration
    return Plan(
        request=request,
        control_points=points,
        trajectory=spline.then(tail),
        duration=request.duration,
        total_duration=math.ceil(total / tick - 1e-9) * tick,
        hit_index=round(request.duration / tick),
        tick=tick,
        report=make_report(primitive, request, problem, solutions, pieces, reach),
        warm=Warm(len(problem.hull.s), [solution.near for solution in solutions]),
    )


def _solved(
    problem: Problem, effort: Effort, warm: Warm | None = None, joints: np.ndarray | None = None
) -> list[Solution]:
    """The optimum of every joint or of the `joints` (n,). Raises InfeasibleRows or SolverFailed.

    Rows of an earlier motion are demanded where this one might have done without, so no verdict rests on them.
    """
    if warm is not None and warm.points == len(problem.hull.s):
        try:
            return _verified(problem, solve(problem, effort, warm.rows, joints))
        except (InfeasibleRows, SolverFailed):
            pass
    return _verified(problem, solve(problem, effort, None, joints))


def _verified(problem: Problem, solutions: list[Solution]) -> list[Solution]:
    """The solutions, whose limits were looked at, with their equalities looked at. Raises SolverFailed."""
    joints = np.array([solution.joint for solution in solutions])
    x = np.array([solution.x for solution in solutions])
    missed = np.abs(problem.equalities.missed(x, problem.targets, joints))
    allowed = EQUALITY_TOLERANCE * np.maximum(1.0, np.abs(problem.targets[joints]).max(axis=1))[:, None]
    if not (missed <= allowed).all():
        # Large weights that cancel each other, as in a motion that is over at once, leave their rounding.
        terms = np.matmul(np.abs(problem.equalities.rows[joints]), np.abs(x)[:, :, None])
        allowed = np.maximum(allowed, ROUNDING * terms[:, :, 0])
    if not (missed <= allowed).all():
        joint = (missed / allowed).max(axis=1).argmax()
        raise SolverFailed(int(joints[joint]), f"equalities are off by {missed[joint].max():.1e}")
    return solutions


def _stopped(
    request: MotionRequest, problem: Problem, solutions: list[Solution]
) -> tuple[np.ndarray, Trajectory, np.ndarray, np.ndarray]:
    """Control points (J, N + 2) of the moving part, what follows it, the lowest and highest values there (J, 4, 2), and
    the joints (n,) in which these leave the limits."""
    x = np.array([solution.x for solution in solutions])
    points = problem.space.positions(x)
    goal, limits, given = request.goal, request.limits, request.final_accelerations
    end = goal.positions + request.follow_through * goal.velocities
    line = _straight(request)
    reach = np.empty((len(end), 4, 2))
    reach[:, :2, 0] = reach[:, :2, 1] = np.stack([goal.positions, goal.velocities], axis=1)
    reach[:, 2:, 0], reach[:, 2:, 1] = np.inf, -np.inf
    if request.tail == "coast":
        return points, line, reach, np.zeros(0, dtype=int)
    reached = problem.space.weights(x)[:, -1] / problem.duration**2
    final = np.where(np.isnan(given), reached, given)
    halt = fastest_stop(goal.velocities, final, limits.accelerations, limits.jerks)
    low, high, slow, fast = halt.extremes(end)
    motion = halt.trajectory(end)
    accelerations, jerks = 2 * motion.coefficients[..., 2], 6 * motion.coefficients[..., 3]
    reach[:, 0, 0], reach[:, 0, 1] = np.minimum(low, goal.positions), np.maximum(high, goal.positions)
    reach[:, 1, 0], reach[:, 1, 1] = slow, fast
    reach[:, 2, 0], reach[:, 2, 1] = accelerations.min(axis=0), accelerations.max(axis=0)
    reach[:, 3, 0], reach[:, 3, 1] = jerks.min(axis=0), jerks.max(axis=0)
    ranges = limits.ranges
    outside = (reach[:, :2, 0] < ranges[:, :2, 0] - TOUCH) | (reach[:, :2, 1] > ranges[:, :2, 1] + TOUCH)
    behind = line.then(motion) if request.straight_duration else motion
    return points, behind, reach, np.flatnonzero(outside.any(axis=1))


def _straight(request: MotionRequest) -> Trajectory:
    """The part with the final velocity: before the hit for a rest fraction, after it to follow through."""
    goal = request.goal
    line = np.zeros((1, request.joint_count, COEFFICIENTS))
    line[0, :, 0] = goal.positions - request.rest_fraction * request.duration * goal.velocities
    line[0, :, 1] = goal.velocities
    return Trajectory(np.array([0.0, request.straight_duration]), line)


def _refusal(
    primitive: Primitive,
    request: MotionRequest,
    tick: float,
    failed: InfeasibleRows | SolverFailed,
    effort: Effort,
    remedy: bool,
) -> Infeasible | SolverFailed:
    """The answer to a request that failed, with a duration that works if one is found.

    Raises CannotStop where none could, because the arm would not come to rest inside its limits.
    """
    found = None
    if remedy:
        first_failing = _first_failing(primitive, final_accelerations(request), effort)
        low = math.ceil(request.duration / tick - 1e-9)
        found = min_duration(request, first_failing, low, math.ceil(low * FACTOR), tick)
    if isinstance(failed, SolverFailed):
        if found is None:
            return failed
        failed = InfeasibleRows(failed.joint, QUANTITIES.index("jerk"), 1.0)
    return Infeasible(
        failed.joint,
        QUANTITIES[failed.quantity],
        failed.s * request.moving_duration,
        found.duration if found else None,
        [w.time_from_start for w in found.waypoints] if found else None,
    )


def _first_failing(primitive: Primitive, final: np.ndarray, effort: Effort) -> FirstFailing:
    """What tells which joint cannot be planned in a duration, with the intervals `final` of final accelerations."""

    def first_failing(request: MotionRequest, joints: list[int]) -> int | None:
        try:
            fixed = fixed_values(request)
            check_fixed(request, fixed)
            problem = build(primitive, request, fixed, final)
        except (LimitExceeded, InvalidMotion):
            return joints[0]
        return next((joint for joint in joints if not _works(problem, joint, effort)), None)

    return first_failing


def _works(problem: Problem, joint: int, effort: Effort) -> bool:
    """Whether a joint can be planned with a probe's share of the effort. Raises OutOfTime where no effort is left."""
    effort.spend_on_look(joint)
    share = effort.share(PROBE)
    try:
        _verified(problem, solve(problem, share, None, np.array([joint]), probe=True))
    except (InfeasibleRows, SolverFailed):
        return False
    finally:
        effort.give_back(share)
    return True
