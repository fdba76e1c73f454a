"""Plans of one joint by Volley and by other solvers, and Volley's distance from the optimum."""

import gc
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from benchmarks.cases import Case
from benchmarks.peers import Answer, FullProblem, dmp_solver, ruckig_motion
from benchmarks.timing import milliseconds, timed
from motion import splines
from motion.errors import MotionError
from motion.gaussian import plan_gaussian
from motion.gaussian_basis import make_basis
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import MotionRequest

PAPER = "CVXOPT, full"
"""Reference for times: the paper's solver on its full problem."""


FINE = np.linspace(0, 1, 10001)
"""Instants at which motions are judged, ten times finer than those of the full problem."""


@dataclass
class Column:
    """The results of one solver.

    seconds: of each solved goal. violations: the worst of each, as a part of half a limit's range. errors: of the
    imitation, as a part of the demonstration's rms acceleration. unsolved: number of goals.
    """

    seconds: list[float] = field(default_factory=list)
    violations: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    unsolved: int = 0

    def summary(self) -> dict[str, float]:
        """Return milliseconds, the worst violation and the median error."""
        worst = {"violation": max(self.violations, default=np.nan), "error": float(np.median(self.errors or [np.nan]))}
        return {**milliseconds(self.seconds), **worst, "solved": len(self.violations), "unsolved": self.unsolved}

    def judge(self, primitive: Primitive, request: MotionRequest, accelerations: np.ndarray) -> None:
        """Integrate accelerations (n,), equally spaced over the motion, and append violation and imitation error."""
        s = np.linspace(0, 1, len(accelerations))
        step = request.duration / (len(s) - 1)
        velocities = _integrated(accelerations, step, request.start.velocities[0])
        positions = _integrated(velocities, step, request.start.positions[0])
        jerks = np.diff(accelerations) / step
        outside = 0.0
        curves = positions, velocities, accelerations, jerks
        for values, (low, high) in zip(curves, request.limits.ranges[0], strict=True):
            outside = max(outside, float(max(values.max() - high, low - values.min()) / ((high - low) / 2)))
        wanted = (primitive.duration / request.duration) ** 2 * primitive.sample(s).accelerations[:, 0]
        self.violations.append(outside)
        self.errors.append(float(np.sqrt(np.mean((accelerations - wanted) ** 2) / np.mean(wanted**2))))


def compare(primitives: list[Primitive], cases: list[tuple[int, Case]]) -> dict[str, Column]:
    """Solve every case of one joint with every solver in turn, so that all run under the same conditions."""
    full = [FullProblem(primitive) for primitive in primitives]
    dmps = [dmp_solver(primitive) for primitive in primitives]
    columns: dict[str, Column] = {}
    for joint, case in cases:
        gc.collect(1)
        primitive, request = primitives[joint], case.request
        works = _volley(primitive, case) | _others(full[joint], dmps[joint], request)
        # Evaluated only after all have run, because the evaluation fills the caches.
        for name, (seconds, answer) in {name: timed(work) for name, work in works.items()}.items():
            column = columns.setdefault(name, Column())
            if answer is None:
                column.unsolved += 1
                continue
            column.seconds.append(seconds)
            column.judge(primitive, request, _accelerations(name, answer, request))
    return columns


def _volley(primitive: Primitive, case: Case) -> dict[str, Callable[[], Answer]]:
    """Return calls that make a complete plan, with stop, limits and report; they return control points."""
    request, warm = case.request, plan(primitive, case.before).warm
    return {
        "Volley, cold": lambda: plan(primitive, request).control_points[0],
        "Volley, warm": lambda: plan(primitive, request, warm=warm).control_points[0],
    }


def _others(
    problem: FullProblem, dmp: Callable[[MotionRequest], Answer], request: MotionRequest
) -> dict[str, Callable[[], Answer]]:
    """Return calls that only solve; they return weights, or accelerations of methods without weights."""
    return {
        "PIQP, full": lambda: problem.piqp(request),
        PAPER: lambda: problem.cvxopt(request),
        "DAQP, full": lambda: problem.daqp(request),
        "Clarabel, full": lambda: problem.clarabel(request),
        "Ruckig": lambda: ruckig_motion(request),
        "DMPWithFinalVelocity": lambda: dmp(request),
    }


def _accelerations(name: str, answer: np.ndarray, request: MotionRequest) -> np.ndarray:
    if name.startswith("Volley"):
        return splines.derivative(answer[None], FINE, 2)[:, 0] / request.duration**2
    if name.endswith("full"):
        return make_basis(len(answer)).rows(FINE, 0) @ answer / request.duration**2
    return answer


def relative_errors(primitives: list[Primitive], cases: list[tuple[int, Case]]) -> dict[str, float]:
    """Return Volley's imitation error relative to the paper's optimum: median, worst, number of goals."""
    ratios = []
    for joint, case in cases:
        primitive, request = primitives[joint], case.request
        try:
            best = plan_gaussian(primitive, request).report.imitation_rms[0]
        except MotionError:  # no comparison where the paper's method finds no plan
            continue
        ratios.append(float(plan(primitive, request).report.imitation_rms[0] / best))
    return {"median": float(np.median(ratios)), "worst": max(ratios), "goals": len(ratios)}


def _integrated(values: np.ndarray, step: float, start: float) -> np.ndarray:
    return start + np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * step)])
