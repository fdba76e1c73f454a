"""`python -m benchmarks.planning`: the planner beside other solvers and planners, in one run on one machine.

Times are processor times of one thread, which on an idle machine are wall times: other work on the machine stretches
them less. Every solver meets every goal in turn, so that all see the same machine. Garbage is collected between goals,
as the planner does.
"""

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import tyro
from motion.basis import make_grid
from motion.fixed import Fixed, fixed_values
from motion.problem import build
from motion.solver import solve
from motion.stopping import arriving
from rich.console import Console
from rich.table import Table

from benchmarks.cases import Case, draw, forehand, joint_of
from benchmarks.machine import save
from benchmarks.peers import Answer, FullProblem, dmp_solver, ruckig_motion
from motion.errors import MotionError
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import MotionRequest, Waypoint
from services.runtime import freeze_garbage


@dataclass
class Column:
    """What one solver did: seconds, worst violation in parts of half a limit's range, imitation error in parts of the
    demonstration's rms acceleration, and how many goals it did not solve."""

    seconds: list[float] = field(default_factory=list)
    violations: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    unsolved: int = 0

    def summary(self) -> dict[str, float]:
        """Milliseconds, and the worst of the rest."""
        worst = {"violation": max(self.violations, default=np.nan), "error": float(np.median(self.errors or [np.nan]))}
        return {**milliseconds(self.seconds), **worst, "solved": len(self.violations), "unsolved": self.unsolved}


def milliseconds(seconds: list[float]) -> dict[str, float]:
    """Median and 99th percentile."""
    return {"p50_ms": 1e3 * float(np.median(seconds)), "p99_ms": 1e3 * float(np.percentile(seconds, 99))}


def timed(work: Callable[[], Answer]) -> tuple[float, Answer]:
    """Processor time of this thread and the answer."""
    began = time.thread_time()
    answer = work()
    return time.thread_time() - began, answer


def fine_accelerations(primitive: Primitive, weights: np.ndarray, request: MotionRequest) -> np.ndarray:
    """Accelerations (10001,) of basis weights, ten times finer than the grid."""
    rows = make_grid(primitive.basis_count).basis.rows(np.linspace(0, 1, 10001), 0)
    return rows @ weights / request.duration**2


def judge(column: Column, primitive: Primitive, request: MotionRequest, accelerations: np.ndarray) -> None:
    """Integrate accelerations and note the worst violation and the imitation error."""
    s = np.linspace(0, 1, len(accelerations))
    step = request.duration / (len(s) - 1)

    def integrated(values: np.ndarray, start: float) -> np.ndarray:
        return start + np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * step)])

    velocities = integrated(accelerations, request.start.velocities[0])
    positions = integrated(velocities, request.start.positions[0])
    jerks = np.diff(accelerations) / step
    outside = 0.0
    for values, (low, high) in zip(
        (positions, velocities, accelerations, jerks), request.limits.ranges[0], strict=True
    ):
        outside = max(outside, float(max(values.max() - high, low - values.min()) / ((high - low) / 2)))
    demonstrated = primitive.accelerations[:, 0] * (primitive.duration / request.duration) ** 2
    wanted = np.interp(s, np.linspace(0, 1, len(demonstrated)), demonstrated)
    column.violations.append(outside)
    column.errors.append(float(np.sqrt(np.mean((accelerations - wanted) ** 2) / np.mean(wanted**2))))


def compare(primitives: list[Primitive], cases: list[tuple[int, Case]]) -> dict[str, Column]:
    """Every solver on every case of one joint, in turn."""
    full = [FullProblem(primitive) for primitive in primitives]
    dmps = [dmp_solver(primitive) for primitive in primitives]
    columns: dict[str, Column] = {}
    for joint, case in cases:
        gc.collect(1)
        primitive, request, problem = primitives[joint], case.request, full[joint]
        warm = plan(primitive, case.before).warm

        def ours(primitive: Primitive = primitive, request: MotionRequest = request, **more: object) -> np.ndarray:
            return plan(primitive, request, **more).weights[0]  # type: ignore[arg-type]

        in_weights: dict[str, Callable[[], Answer]] = {
            "Volley, cold": ours,
            "Volley, warm": lambda warm=warm, ours=ours: ours(warm=warm),
            "PIQP, full": lambda problem=problem, request=request: problem.piqp(request),
            "CVXOPT, full": lambda problem=problem, request=request: problem.cvxopt(request),
            "DAQP, full": lambda problem=problem, request=request: problem.daqp(request),
            "Clarabel, full": lambda problem=problem, request=request: problem.clarabel(request),
        }
        in_time: dict[str, Callable[[], Answer]] = {
            "Ruckig": lambda request=request: ruckig_motion(request),
            "DMPWithFinalVelocity": lambda dmp=dmps[joint], request=request: dmp(request),
        }
        # Judged only when all are done: what judges fills the caches with its own.
        for name, (seconds, answer) in {n: timed(work) for n, work in {**in_weights, **in_time}.items()}.items():
            column = columns.setdefault(name, Column())
            if answer is None:
                column.unsolved += 1
                continue
            column.seconds.append(seconds)
            motion = fine_accelerations(primitive, answer, request) if name in in_weights else answer
            judge(column, primitive, request, motion)
    return columns


def growth(count: int) -> dict[str, dict[str, float]]:
    """Milliseconds of a cold plan by basis functions, instants, joints and way-points."""
    found = {}
    for size in (25, 50, 100):
        primitive = joint_of(forehand(size), 1)
        found[f"{size} basis functions"] = _cold(primitive, [c.request for c in draw(primitive, count, 7)])
    primitive = joint_of(forehand(), 1)
    for intervals in (500, 1000, 2000, 4000):
        requests = [c.request for c in draw(primitive, count, 7)]
        found[f"{intervals + 1} instants, program alone"] = _programs(primitive, requests, intervals)
    for joints in (1, 2, 4, 6, 12):
        primitive = forehand(joints=joints)
        found[f"{joints} joints"] = _cold(primitive, [c.request for c in draw(primitive, count, 7)])
    primitive = forehand()
    for waypoints in (0, 1, 2, 4):
        requests = [with_waypoints(primitive, c.request, waypoints) for c in draw(primitive, count, 7)]
        found[f"6 joints, {waypoints} way-points"] = _cold(primitive, requests)
    return found


def with_waypoints(primitive: Primitive, request: MotionRequest, count: int) -> MotionRequest:
    """The request through positions of its own plan, so that it can be kept."""
    times = request.duration * np.linspace(0, 1, count + 2)[1:-1]
    through = plan(primitive, request).sample(times).positions
    free = np.full(request.joint_count, np.nan)
    return replace(request, waypoints=tuple(Waypoint(float(t), p, free) for t, p in zip(times, through, strict=True)))


def _cold(primitive: Primitive, requests: list[MotionRequest]) -> dict[str, float]:
    seconds = []
    for request in requests:
        try:
            seconds.append(timed(lambda request=request: plan(primitive, request).weights)[0])
        except MotionError:  # way-points can ask for too much; refusals do not count
            continue
    return milliseconds(seconds or [np.nan])


def _programs(primitive: Primitive, requests: list[MotionRequest], intervals: int) -> dict[str, float]:
    """The programs of cold plans on a grid of another size, with their certificates."""
    grid = make_grid(primitive.basis_count, intervals)
    seconds = []
    for request in requests:
        fixed, confined = fixed_values(request), arriving(request)

        def work(request: MotionRequest = request, fixed: Fixed = fixed, confined: Answer = confined) -> Answer:
            assert confined is not None
            return solve(grid, build(grid, request, fixed, primitive.theta, confined))[0].x

        seconds.append(timed(work)[0])
    return milliseconds(seconds)


def main(goals: int = 60, seed: int = 5) -> None:
    """Compare on this many goals of one joint with active limits, and print and save what was found."""
    primitives = [joint_of(forehand(), joint) for joint in range(6)]
    drawn = [draw(primitive, -(-goals // 6), seed + joint) for joint, primitive in enumerate(primitives)]
    cases = [(joint, case) for joint, of_joint in enumerate(drawn) for case in of_joint][:goals]
    freeze_garbage()
    compared = {name: column.summary() for name, column in compare(primitives, cases).items()}
    grown = growth(max(5, goals // 6))
    console = Console()
    table = Table("", "p50 ms", "p99 ms", "× CVXOPT", "worst violation", "imitation error", "solved", title="One joint")
    for name, row in compared.items():
        speed = compared["CVXOPT, full"]["p50_ms"] / row["p50_ms"]
        numbers = f"{row['p50_ms']:.2f}", f"{row['p99_ms']:.2f}", f"{speed:.1f}"
        table.add_row(name, *numbers, f"{row['violation']:.1e}", f"{row['error']:.3f}", f"{row['solved']}/{len(cases)}")
    console.print(table)
    table = Table("cold, by", "p50 ms", "p99 ms", title="Growth")
    for name, row in grown.items():
        table.add_row(name, f"{row['p50_ms']:.2f}", f"{row['p99_ms']:.2f}")
    console.print(table)
    console.print(f"saved to {save('planning', {'one joint': compared, 'growth': grown}).name}")


if __name__ == "__main__":
    tyro.cli(main)
