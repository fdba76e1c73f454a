"""Sections III-B and IV: CVXOPT, the paper's solver, compared with PIQP and Volley on the figures' problems.

Rows named solver.time… depend on the machine and are not tested.
"""

import time
from collections.abc import Callable
from typing import TypeVar

import cvxopt
import numpy as np
from cvxopt import solvers

from experiments import fig2, fig3, fig4
from experiments.common import STEP, Outcome, Row, ask, figure_primitive, limits, spread, state
from motion.errors import MotionError
from motion.gaussian import BASIS_COUNT, optimum
from motion.gaussian_program import INSTANTS, GaussianProgram, make_programs, rows
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import MotionRequest

REPEATS = 5
RANDOM = 40
SAME = "any existing QP solver can be used (III-B)"
TENS = "a problem with hundreds of parameters in tens of milliseconds (abstract)"
TENTHS = "with limits at 1000 points in the order of tenths of a second (III-B)"
Result = TypeVar("Result")
EVERYTHING = Limits(np.array([[-1.9, 1.9]]), np.array([12.0]), np.array([160.0]), np.array([1e4]))


def run() -> Outcome:
    """Solve each figure's problem, and random ones with limits on all quantities."""
    primitive = figure_primitive()
    problems = {
        "fig2": ask(fig2.START, fig2.GOAL, fig2.DURATION),
        "fig3": ask(goal=fig3.GOAL, within=limits(fig3.LIMIT - fig3.MARGIN)),
        "fig4": ask(waypoint=(fig4.TIME, fig4.POSITION, fig4.VELOCITIES["other"])),
        "fig4_jerk": ask(
            within=limits(jerk=fig4.MAX_JERK), waypoint=(fig4.TIME, fig4.POSITION, fig4.VELOCITIES["other"])
        ),
    }
    found = []
    for name, request in problems.items():
        apart, imitation, theirs, same, ours = compared(primitive, request)
        found += [
            Row(f"solver.{name}.objective_apart", apart, "of the demonstration's", SAME),
            Row(f"solver.{name}.qp_imitation", imitation, "of CVXOPT's"),
            Row(f"solver.time.{name}.cvxopt", 1e3 * theirs, "ms", TENTHS if name in ("fig3", "fig4_jerk") else TENS),
            Row(f"solver.time.{name}.piqp", 1e3 * same, "ms"),
            Row(f"solver.time.{name}.qp", 1e3 * ours, "ms"),
            Row(f"solver.time.{name}.ratio", theirs / ours, "1"),
        ]
    return Outcome(found + random_goals(primitive))


def random_goals(primitive: Primitive) -> list[Row]:
    """Solve random goals with limits on position, velocity, acceleration and jerk at all 1001 instants."""
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
    apart, imitation, theirs, same, ours = np.array(found).T
    return [
        *spread("solver.random.objective_apart", apart, "of the demonstration's", SAME),
        *spread("solver.random.qp_imitation", imitation, "of CVXOPT's"),
        Row("solver.time.random.cvxopt", float(1e3 * np.median(theirs)), "ms", TENTHS),
        Row("solver.time.random.piqp", float(1e3 * np.median(same)), "ms"),
        Row("solver.time.random.qp", float(1e3 * np.median(ours)), "ms"),
        *spread("solver.time.random.ratio", theirs / ours, "1"),
    ]


def compared(
    primitive: Primitive, request: MotionRequest, repeats: int = REPEATS
) -> tuple[float, float, float, float, float]:
    """Compare CVXOPT, PIQP and Volley on one problem.

    Return the distance of PIQP's objective from CVXOPT's, as a part of the demonstration's; Volley's imitation error as
    a part of CVXOPT's; the least time (s) of CVXOPT and of PIQP, for solving alone, and of Volley, for the whole plan.
    """
    program = make_programs(primitive, request, BASIS_COUNT)[0]
    problem = as_matrices(program)
    solved, theirs = least_time(lambda: solvers.qp(*problem, options={"show_progress": False}), repeats)
    ours, same = least_time(lambda: optimum(program, 0), repeats)
    made, whole = least_time(lambda: plan(primitive, request, STEP), repeats)
    best = missed(primitive, np.array(solved["x"])[:, 0])
    imitation = made.report.imitation_rms[0] * request.duration**2 / np.sqrt(best)
    apart = abs(missed(primitive, ours) - best) / missed(primitive, 0 * ours)
    return apart, float(imitation), theirs, same, whole


def as_matrices(program: GaussianProgram) -> list[cvxopt.matrix | None]:
    """Return P, q, G, h, A, b for CVXOPT, with a row for each finite side of a limit."""
    sides = (program.G, program.high), (-program.G, -program.low)
    finite = [(matrix[np.isfinite(bound)], bound[np.isfinite(bound)]) for matrix, bound in sides]
    limited = [cvxopt.matrix(np.concatenate(x)) for x in zip(*finite, strict=True)] if len(program.G) else [None, None]
    return [cvxopt.matrix(program.P), cvxopt.matrix(program.c), *limited, *map(cvxopt.matrix, (program.A, program.b))]


def missed(primitive: Primitive, w: np.ndarray) -> float:
    """Return the mean square (rad²) of the residual of d″ with the weights w (N,)."""
    left = rows(BASIS_COUNT)[2] @ w - primitive.duration**2 * primitive.sample(INSTANTS).accelerations[:, 0]
    return float(np.mean(left**2))


def least_time(action: Callable[[], Result], repeats: int) -> tuple[Result, float]:
    """Return the result of an action, and the least of its measured times (s), which has the least disturbance."""
    took, result = [], action()
    for _ in range(repeats):
        began = time.perf_counter()
        result = action()
        took.append(time.perf_counter() - began)
    return result, min(took)
