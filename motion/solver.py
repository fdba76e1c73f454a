"""Row generation: the few limit rows that matter, found by solving, looking and adding (design 1.5).

Joints are independent programs, but looked at together: one matrix product evaluates all that changed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motion.basis import Grid
from motion.certificate import Certificate, Failure, certify
from motion.errors import SolverFailed
from motion.look import Look, with_neighbours
from motion.problem import SIGNS, Problem
from motion.qp import shortest_step

MAX_ROUNDS = 30
MAX_MENDS = 5

WARM_NEIGHBOURS = np.array([-2, 0, 2])
"""Where, in samples around the peaks of the previous plan, those of the next one are expected."""

DROPPING_ROUNDS = 6
"""Rows without a multiplier are dropped between these first rounds; the objective grows all the same, so it ends."""

_BINDING = 1e-5
_IDLE = 1e-8
_DEAD = 1e-9


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
    with and their multipliers; how many rounds it took, and whether rows had to be demanded beyond their band."""

    x: np.ndarray
    certificate: Certificate
    rows: np.ndarray
    multipliers: np.ndarray
    rounds: int
    mended: bool

    def binding(self) -> np.ndarray:
        """Which rows (m,) carry a multiplier worth naming."""
        return self.multipliers > _BINDING * self.multipliers.max(initial=1e-300)


def solve(grid: Grid, problem: Problem, warm: Sequence[np.ndarray] | None = None) -> list[Solution]:
    """Per joint the motion nearest to the demonstrated one that meets the equalities and all limits.

    Certified where possible. `warm` are rows to start with, per joint. Raises Clash where the rows are infeasible,
    SolverFailed for numerical trouble.
    """
    everything = [_WorkingSet(grid, problem, joint) for joint in range(len(problem.origin))]
    for work, rows in zip(everything, warm or (), strict=False):
        if rows.size:
            work.demand(with_neighbours(rows, WARM_NEIGHBOURS, len(grid.s)))
    look, every = Look(problem), np.arange(len(everything))
    curves = _generate_rows(look, grid, everything, every, np.empty((len(every), 6, len(grid.s))))
    certificates = certify(grid, problem, every, np.array([work.x for work in everything]), curves)
    for _ in range(MAX_MENDS):
        failed = np.array([joint for joint in every if certificates[joint].failures], dtype=int)
        if not failed.size:
            break
        for joint in failed:
            everything[joint].mend(certificates[joint].failures)
        curves = _generate_rows(look, grid, everything, failed, curves)
        x = np.array([everything[joint].x for joint in failed])
        for joint, certificate in zip(failed, certify(grid, problem, failed, x, curves[failed]), strict=True):
            certificates[joint] = certificate
    return [work.solution(certificate) for work, certificate in zip(everything, certificates, strict=True)]


def _generate_rows(
    look: Look, grid: Grid, everything: list["_WorkingSet"], joints: np.ndarray, curves: np.ndarray
) -> np.ndarray:
    """Demand rows of the joints until all their samples are accepted; `curves` (J, 6, M) with theirs in place."""
    while joints.size:
        found = grid.curves(np.array([everything[joint].x for joint in joints]))
        missing = look.missing(joints, found, first=all(everything[joint].rounds == 0 for joint in joints))
        curves[joints] = found
        for joint, rows in zip(joints, missing, strict=True):
            if rows is not None:
                everything[joint].demand_more(rows)
        joints = joints[[rows is not None for rows in missing]]
    return curves


class _WorkingSet:
    """One joint's rows in play and the motion they lead to.

    In u = z − z0, where z0 belongs to the optimum without limits, the cost is |u|² and u runs in the null space of the
    equalities.
    """

    def __init__(self, grid: Grid, problem: Problem, joint: int) -> None:
        self.grid, self.problem, self.joint = grid, problem, joint
        self.x = problem.origin[joint]
        self.rows = np.zeros(0, dtype=int)
        self.multipliers = np.zeros(0)
        self.further: dict[int, float] = {}
        self.rounds = 0
        self.precise = False

    def solution(self, certificate: Certificate) -> Solution:
        """What was found."""
        return Solution(self.x, certificate, self.rows, self.multipliers, self.rounds, bool(self.further))

    def demand(self, rows: np.ndarray, precise: bool = False) -> None:
        """Take rows in and solve. Raises Clash or SolverFailed."""
        self.rows = np.union1d(self.rows, rows)
        self.precise = precise
        self.rounds += 1
        if self.rounds > MAX_ROUNDS:
            raise SolverFailed(self.joint, f"no end after {MAX_ROUNDS} rounds")
        matrix, excess = self._program()
        size = excess.max(initial=0.0)
        if size <= 0:
            self.x, self.multipliers = self.problem.origin[self.joint], np.zeros(len(self.rows))
            return
        u, self.multipliers, status = shortest_step(matrix, excess / size, precise)
        if status == "infeasible":
            raise self._clash()
        if status:
            raise SolverFailed(self.joint, status)
        self.x = self.problem.origin[self.joint].copy()
        self.x[:-2] += size * u
        self.x = self.problem.equalities.corrected(self.joint, self.x, self.problem.targets)

    def demand_more(self, rows: np.ndarray) -> None:
        """Solve again with the rows; with those in play but precisely, if there are no others."""
        known = bool(np.isin(rows, self.rows).all())
        if known and self.precise:
            raise SolverFailed(self.joint, "rows already demanded stay violated")
        if not known and self.rounds <= DROPPING_ROUNDS:
            self.rows = self.rows[self.multipliers > _IDLE * self.multipliers.max(initial=0.0)]
        self.demand(rows, precise=known)

    def mend(self, failures: tuple[Failure, ...]) -> None:
        """Demand the samples on both sides of where a limit is passed between them, and where they are demanded
        already, further inside by as much."""
        rows = []
        for failure in failures:
            left = (failure.side * 4 + failure.quantity) * len(self.grid.s) + failure.sample
            if left in self.rows and left + 1 in self.rows:
                for row in (left, left + 1):
                    self.further[row] = self.further.get(row, 0.0) + 1.1 * failure.overshoot
            rows += [left, left + 1]
        self.demand(np.array(rows), precise=True)

    def _program(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows projected on the null space and of unit norm, turned so that excess is positive; by how much the optimum
        without limits passes what they demand, in these units."""
        problem, grid, joint = self.problem, self.grid, self.joint
        side, row = np.divmod(self.rows, 4 * len(grid.s))
        quantity, sample = np.divmod(row, len(grid.s))
        matrix = grid.rows(row)
        matrix *= SIGNS[side][:, None]
        place = side, joint, quantity, sample
        excess = matrix @ problem.origin[joint] - problem.limit[place] + problem.band[place]
        for row, further in self.further.items():
            excess[self.rows == row] += further
        span = problem.equalities.span[joint]
        on_weights = matrix[:, :-2]
        matrix = on_weights - (on_weights @ span) @ span.T
        norms = np.sqrt(np.einsum("ij,ij->i", matrix, matrix))
        alive = (norms > _DEAD * grid.norms[quantity]) & np.isfinite(excess)
        if not alive.all():
            # What the equalities alone decide was compared with the limits before; neighbours may have no limit.
            self.rows = self.rows[alive]
            matrix, excess, norms = matrix[alive], excess[alive], norms[alive]
        return matrix / norms[:, None], excess / norms

    def _clash(self) -> Clash:
        """Names the quantity with the largest sum of multipliers, and where its largest is."""
        quantity, sample = np.divmod(self.rows % (4 * len(self.grid.s)), len(self.grid.s))
        hardest = np.bincount(quantity, weights=self.multipliers, minlength=4).argmax()
        worst = np.where(quantity == hardest, self.multipliers, -1.0).argmax()
        return Clash(self.joint, int(hardest), float(self.grid.s[sample[worst]]))
