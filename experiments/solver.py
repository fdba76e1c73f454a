"""Sections III-B and IV: CVXOPT, the paper's solver, against this planner on the figures' problems.

Rows called solver.time… are of this run on this machine; nobody compares them.
"""

import time
from collections.abc import Callable
from typing import TypeVar

import cvxopt
import numpy as np
from cvxopt import solvers

from experiments import fig2, fig3, fig4
from experiments.common import STEP, Outcome, Row, ask, figure_primitive, limits, spread, state
from motion.basis import make_grid
from motion.errors import MotionError
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import MotionRequest

REPEATS = 5
RANDOM = 40
ORDERS = (-2, -1, 0, 1)
SAME = "any existing QP solver can be used (III-B)"
TENS = "a problem with hundreds of parameters in tens of milliseconds (abstract)"
TENTHS = "with limits at 1000 points in the order of tenths of a second (III-B)"
Result = TypeVar("Result")
EVERYTHING = Limits(np.array([[-1.9, 1.9]]), np.array([12.0]), np.array([160.0]), np.array([1e4]))


def run() -> Outcome:
    """Each figure's problem, and random ones with limits on everything."""
    primitive = figure_primitive()
    problems = {
        "fig2": ask(fig2.START, fig2.GOAL, fig2.DURATION),
        "fig3": ask(goal=fig3.GOAL, within=limits(fig3.LIMIT - fig3.MARGIN)),
        "fig4": ask(waypoint=(fig4.TIME, fig4.POSITION, fig4.VELOCITIES["other"])),
        "fig4_jerk": ask(
            within=limits(jerk=fig4.MAX_JERK), waypoint=(fig4.TIME, fig4.POSITION, fig4.VELOCITIES["other"])
        ),
    }
    rows = []
    for name, request in problems.items():
        excess, theirs, ours = compared(primitive, request)
        rows += [
            Row(f"solver.{name}.objective_excess", excess, "of CVXOPT's", SAME),
            Row(f"solver.time.{name}.cvxopt", 1e3 * theirs, "ms", TENTHS if name in ("fig3", "fig4_jerk") else TENS),
            Row(f"solver.time.{name}.planner", 1e3 * ours, "ms"),
            Row(f"solver.time.{name}.ratio", theirs / ours, "1"),
        ]
    return Outcome(rows + random_goals(primitive))


def random_goals(primitive: Primitive) -> list[Row]:
    """Goals with limits on position, velocity, acceleration and jerk at all 1001 instants."""
    rng = np.random.default_rng(8)
    found = []
    while len(found) < RANDOM:
        start, goal = state(rng.uniform(-0.5, 0.5), -1.0), state(rng.uniform(-1, 1.5), rng.uniform(-4, 6))
        request = ask(start, goal, round(rng.uniform(0.9, 1.5), 3), EVERYTHING)
        try:
            if plan(primitive, request, STEP).report.rows == 0:
                continue
        except MotionError:
            continue
        found.append(compared(primitive, request, repeats=1))
    excess, theirs, ours = np.array(found).T
    return [
        *spread("solver.random.objective_excess", excess, "of CVXOPT's", SAME),
        Row("solver.time.random.cvxopt", float(1e3 * np.median(theirs)), "ms", TENTHS),
        Row("solver.time.random.planner", float(1e3 * np.median(ours)), "ms"),
        *spread("solver.time.random.ratio", theirs / ours, "1"),
    ]


def compared(primitive: Primitive, request: MotionRequest, repeats: int = REPEATS) -> tuple[float, float, float]:
    """Excess of this planner's objective, and the least time (s) each takes; CVXOPT's is the solving alone."""
    made, ours = least_time(lambda: plan(primitive, request, STEP), repeats)
    problem = full_problem(primitive, request)
    solved, theirs = least_time(lambda: solvers.qp(*problem, options={"show_progress": False}), repeats)
    best = objective(primitive, np.array(solved["x"])[:, 0])
    return objective(primitive, made.weights[0]) / best - 1, theirs, ours


def full_problem(primitive: Primitive, request: MotionRequest) -> list[cvxopt.matrix | None]:
    """P, q, G, h, A, b of eq. 16 and 17 in normalised time, every limit at all 1001 instants."""
    grid = make_grid(primitive.basis_count)
    basis, duration, s = grid.basis, request.duration, grid.s
    p0, v0 = request.start.positions[0], request.start.velocities[0]
    offsets = (p0 + s * duration * v0, v0 + 0 * s, 0 * s, 0 * s)
    rows, bounds = [], []
    for order, offset, (low, high) in zip(ORDERS, offsets, request.limits.ranges[0], strict=True):
        if np.isfinite(high):
            matrix, scale = basis.rows(s, order), duration ** (order + 2)
            rows += [matrix, -matrix]
            bounds += [scale * (high - offset), scale * (offset - low)]
    equal, targets = [], []
    points = [(w.time_from_start, w.positions[0], w.velocities[0]) for w in request.waypoints]
    for at, position, velocity in (*points, (duration, request.goal.positions[0], request.goal.velocities[0])):
        place = np.array([at / duration])
        equal += [basis.rows(place, -2), basis.rows(place, -1)]
        targets += [position - p0 - at * v0, duration * (velocity - v0)]
    theta = cvxopt.matrix(-2 * primitive.theta[0])
    inequalities = [cvxopt.matrix(np.concatenate(x)) for x in (rows, bounds)] if rows else [None, None]
    equalities = [cvxopt.matrix(np.concatenate(equal)), cvxopt.matrix(np.array(targets))]
    return [cvxopt.matrix(2 * basis.gram()), theta, *inequalities, *equalities]


def objective(primitive: Primitive, w: np.ndarray) -> float:
    """Mean square (rad²) of what is left of d'' by the weights w (N,), from which the optimum differs."""
    grid = make_grid(primitive.basis_count)
    left = grid.basis.rows(grid.s, 0) @ w - primitive.duration**2 * primitive.accelerations[:, 0]
    return float(np.mean(left**2))


def least_time(action: Callable[[], Result], repeats: int) -> tuple[Result, float]:
    """What an action returns, and the least of its times (s): the one least disturbed."""
    took, result = [], action()
    for _ in range(repeats):
        began = time.perf_counter()
        result = action()
        took.append(time.perf_counter() - began)
    return result, min(took)
