"""The rows in play of each joint, and the programs that they make (design 1.5)."""

from typing import Self

import numpy as np

from motion.basis import Grid
from motion.certificate import Failure
from motion.errors import SolverFailed
from motion.limits import SIGNS
from motion.problem import Problem

MAX_ROUNDS = 30

DROPPING_ROUNDS = 6
"""Rows without a multiplier are dropped between these first rounds; the objective grows all the same, so it ends."""

_IDLE = 1e-8
_DEAD = 1e-9


class WorkingSet:
    """One joint's rows in play and the motion that they lead to."""

    def __init__(self, joint: int, origin: np.ndarray) -> None:
        self.joint, self.x = joint, origin
        self.rows = np.zeros(0, dtype=int)
        self.multipliers = np.zeros(0)
        self.further: dict[int, float] = {}
        self.rounds = 0
        self.precise = False

    def take(self, rows: np.ndarray, precise: bool = False) -> Self:
        """Take rows in, to be solved next. Raises SolverFailed after too many rounds."""
        self.rows = np.array(sorted({*self.rows.tolist(), *rows.tolist()}), dtype=int)
        self.precise = precise
        self.rounds += 1
        if self.rounds > MAX_ROUNDS:
            raise SolverFailed(self.joint, f"no end after {MAX_ROUNDS} rounds")
        return self

    def take_more(self, rows: np.ndarray) -> Self:
        """Take in rows that the motion violates: to be solved precisely where there are none but those in play."""
        known = not set(rows.tolist()).difference(self.rows.tolist())
        if known and self.precise:
            raise SolverFailed(self.joint, "rows already demanded stay violated")
        if not known and self.rounds <= DROPPING_ROUNDS:
            self.rows = self.rows[self.multipliers > _IDLE * self.multipliers.max(initial=0.0)]
        return self.take(rows, precise=known)

    def mend(self, failures: tuple[Failure, ...], count: int) -> Self:
        """Demand the samples on both sides of where a limit is passed between them, and where they are demanded
        already, further inside by as much. The grid has `count` samples."""
        rows = []
        for failure in failures:
            left = (failure.side * 4 + failure.quantity) * count + failure.sample
            if left in self.rows and left + 1 in self.rows:
                for row in (left, left + 1):
                    self.further[row] = self.further.get(row, 0.0) + 1.1 * failure.overshoot
            rows += [left, left + 1]
        return self.take(np.array(rows), precise=True)


def programs(grid: Grid, problem: Problem, works: list[WorkingSet]) -> tuple[np.ndarray, np.ndarray]:
    """The works' rows one after the other, projected on the null space and of unit norm, turned so that excess is
    positive; by how much the optimum without limits passes what they demand, in these units.

    Rows that the equalities alone decide were compared with the limits before, and leave the works; so do neighbours
    without a limit.
    """
    lengths = [len(work.rows) for work in works]
    joint = np.repeat([work.joint for work in works], lengths)
    side, row = np.divmod(np.concatenate([work.rows for work in works]), 4 * len(grid.s))
    quantity = row // len(grid.s)
    matrix = grid.limited[row]
    matrix *= SIGNS[side][:, None]
    place = (side * len(problem.origin) + joint) * 4 * len(grid.s) + row
    demanded = problem.limit.take(place) - problem.band.take(place)
    excess, full, matrix = -demanded, matrix, matrix[:, :-2]
    end = 0
    for work, length in zip(works, lengths, strict=True):
        here = slice(end, end := end + length)
        if work.further:
            excess[here] += [work.further.get(row, 0.0) for row in work.rows.tolist()]
        excess[here] += full[here] @ problem.origin[work.joint]
        span = problem.equalities.span[work.joint]
        matrix[here] -= (matrix[here] @ span) @ span.T
    norms = np.sqrt(np.einsum("ij,ij->i", matrix, matrix))
    alive = (norms > _DEAD * grid.norms[quantity]) & np.isfinite(excess)
    if not alive.all():
        for work in works:
            work.rows = work.rows[alive[joint == work.joint]]
        matrix, excess, norms = matrix[alive], excess[alive], norms[alive]
    return matrix / norms[:, None], excess / norms
