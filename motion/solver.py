"""Row generation: the few limit rows that matter, found by solving, looking and adding (design 1.5).

Joints are independent programs, but looked at together: one matrix product evaluates all that changed.
"""

from dataclasses import dataclass

import numpy as np

from motion.basis import Grid
from motion.certificate import Certificate, certify
from motion.errors import SolverFailed
from motion.look import Look
from motion.problem import Problem
from motion.qp import shortest_step
from motion.working import WorkingSet, programs

MAX_MENDS = 5

_BINDING = 1e-5


class Clash(Exception):
    """The rows of one joint contradict each other; `quantity` (0 to 3) and `s` of the one hardest pressed."""

    def __init__(self, joint: int, quantity: int, s: float) -> None:
        super().__init__(f"joint {joint}: limits clash")
        self.joint = joint
        self.quantity = quantity
        self.s = s


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The optimum of one joint: the motion x (N+2,), its certificate, the rows (numbered as in `Look`) it was solved
    with and their multipliers; how many rounds it took, and by how much some rows had to be demanded beyond their band
    (`further`), because the motion passed the limit between them."""

    x: np.ndarray
    certificate: Certificate
    rows: np.ndarray
    multipliers: np.ndarray
    rounds: int
    further: dict[int, float]

    def binding(self) -> np.ndarray:
        """Which rows (m,) carry a multiplier worth naming."""
        return self.multipliers > _BINDING * self.multipliers.max(initial=1e-300)


def solve(
    grid: Grid, problem: Problem, warm: np.ndarray | None = None, joints: np.ndarray | None = None
) -> list[Solution]:
    """For each joint, or each of the `joints` (n,), the motion nearest to the demonstrated one that meets the
    equalities and all limits.

    Certified where possible. `warm` (J, ≥ 4, M) are the curves of an earlier motion like this one: it begins with the
    rows at which they come near its limits. Raises Clash where the rows are infeasible, SolverFailed for numerical
    trouble.
    """
    works = [WorkingSet(joint, origin) for joint, origin in enumerate(problem.origin)]
    look, failed = Look(problem), np.arange(len(works)) if joints is None else joints
    chosen = [works[joint] for joint in failed]
    if warm is not None:
        near = look.near(warm)
        _solve_programs(grid, problem, [work.take(near[work.joint]) for work in chosen if near[work.joint].size])
    curves = np.empty((len(works), 6, len(grid.s)))
    certificates: dict[int, Certificate] = {}
    for mends in range(MAX_MENDS + 1):
        x = _generate_rows(look, grid, works, failed, curves)
        of_failed = curves if len(failed) == len(works) else curves[failed]
        certificates |= zip(failed.tolist(), certify(grid, problem, failed, x, of_failed), strict=True)
        failed = np.array([joint for joint in failed.tolist() if certificates[joint].failures], dtype=int)
        if not failed.size or mends == MAX_MENDS:
            break
        mended = [works[joint].mend(certificates[joint].failures, len(grid.s)) for joint in failed]
        _solve_programs(grid, problem, mended)
    return [
        Solution(work.x, certificates[work.joint], work.rows, work.multipliers, work.rounds, work.further)
        for work in chosen
    ]


def _generate_rows(
    look: Look, grid: Grid, works: list[WorkingSet], joints: np.ndarray, curves: np.ndarray
) -> np.ndarray:
    """Demand rows of the joints (n,) until all their samples are accepted, and put their `curves` (J, 6, M) in place.

    Returns their motions (n, N+2).
    """
    left = joints
    while left.size:
        found = grid.curves(np.array([works[joint].x for joint in left]))
        missing = look.missing(left, found, first=all(works[joint].rounds == 0 for joint in left))
        curves[left] = found
        wanting = [works[joint].take_more(rows) for joint, rows in zip(left, missing, strict=True) if rows is not None]
        _solve_programs(grid, look.problem, wanting)
        left = np.array([work.joint for work in wanting], dtype=int)
    return np.array([works[joint].x for joint in joints])


def _solve_programs(grid: Grid, problem: Problem, works: list[WorkingSet]) -> None:
    """Find the motions of the works' rows. Raises Clash or SolverFailed.

    In u = z − z0, where z0 belongs to the optimum without limits, the cost is |u|² and u runs in the null space of the
    equalities.
    """
    if not works:
        return
    matrix, excess = programs(grid, problem, works)
    joints = [work.joint for work in works]
    x = problem.origin[joints]
    end = 0
    for motion, work in zip(x, works, strict=True):
        begin, end = end, end + len(work.rows)
        size = excess[begin:end].max(initial=0.0)
        if size <= 0:
            work.multipliers = np.zeros(end - begin)
            continue
        u, work.multipliers, status = shortest_step(matrix[begin:end], excess[begin:end] / size, work.precise)
        if status == "infeasible":
            raise _clash(grid, work)
        if status:
            raise SolverFailed(work.joint, status)
        motion[:-2] += size * u
    for motion, work in zip(problem.equalities.corrected(joints, x, problem.targets), works, strict=True):
        work.x = motion


def _clash(grid: Grid, work: WorkingSet) -> Clash:
    """Names the quantity with the largest sum of multipliers, and where its largest is."""
    quantity, sample = np.divmod(work.rows % (4 * len(grid.s)), len(grid.s))
    hardest = np.bincount(quantity, weights=work.multipliers, minlength=4).argmax()
    worst = np.where(quantity == hardest, work.multipliers, -1.0).argmax()
    return Clash(work.joint, int(hardest), float(grid.s[sample[worst]]))
