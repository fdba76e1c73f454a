"""Row generation: the few limit rows that matter, found by solving, looking and adding (design 1.5).

Joints are independent programs, but looked at together: one matrix product evaluates all that changed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motion.basis import INTERVALS, Grid
from motion.certificate import Certificate, certify
from motion.errors import SolverFailed
from motion.problem import Problem
from motion.qp import shortest_step

MAX_ROUNDS = 30
MAX_CERTIFICATE_ROUNDS = 5
PEAK_NEIGHBOURS = 3
FIRST_STRIDE = 8

_ACCEPTED = 0.9
"""Part of the band that a sample may use up."""
_WORTH_ADDING = 0.2
"""Part of the band beyond which a peak becomes a row once some sample is not accepted."""
_ROUNDING = 2e-7
"""Of half a limit's range: samples beside a boundary value on its limit are not looked at closer."""
_DEAD = 1e-9
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
    """The optimum of one joint: weights z (N,), the grid rows (flat indices quantity·M + sample) it was solved
    with, their multipliers, how many rounds it took, and its certificate."""

    z: np.ndarray
    rows: np.ndarray
    multipliers: np.ndarray
    rounds: int
    row_count: int
    certificate: Certificate

    def binding(self) -> np.ndarray:
        """The rows that carry a multiplier worth naming."""
        if not self.rows.size:
            return self.rows
        return self.rows[self.multipliers > _BINDING * max(self.multipliers.max(), 1e-300)]


def solve(
    grid: Grid, problem: Problem, targets: np.ndarray, warm: Sequence[np.ndarray] | None = None
) -> list[Solution]:
    """Per joint the weights nearest to its row of `targets` (J, N) that meet the equalities and all limits.

    Certified where possible. `warm` are grid rows to start with, per joint. Raises Clash where the rows are
    infeasible, SolverFailed for numerical trouble.
    """
    everything = [_WorkingSet(grid, problem, joint, target) for joint, target in enumerate(targets)]
    for work, rows in zip(everything, warm or (), strict=False):
        if work.add(rows):
            work.resolve("loose")
    look = _Look(problem)
    working = everything
    while working:
        joints = [work.joint for work in working]
        z = np.array([work.z for work in working])
        values = problem.values(grid, z, joints)
        asked = look.rows_to_add(joints, values, [0 if work.rows.size else FIRST_STRIDE for work in working])
        for work, rows in zip(working, asked, strict=True):
            if rows is not None:
                work.demand_more(rows)
        sound = [n for n, rows in enumerate(asked) if rows is None]
        if sound:
            _certify(grid, problem, [working[n] for n in sound], z[sound], values[sound])
        working = [work for work in working if work.certificate is None]
    return [work.solution() for work in everything]


def _certify(grid: Grid, problem: Problem, working: list["_WorkingSet"], z: np.ndarray, values: np.ndarray) -> None:
    """Give each joint its certificate, or another solution with the rows that it takes."""
    for work, found in zip(working, certify(grid, problem, [w.joint for w in working], z, values), strict=True):
        if not found.failures or work.mended == MAX_CERTIFICATE_ROUNDS:
            work.certificate = found
        else:
            work.mend(found.failures)
            work.resolve("tight")


class _Look:
    """Compares values on the grid with what is demanded of them."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        inside = 1 - _WORTH_ADDING
        rounding = _ROUNDING * problem.half_range[:, :, None]
        self.lower = problem.lower + inside * problem.lower_band - rounding
        self.upper = problem.upper - inside * problem.upper_band + rounding

    def rows_to_add(self, joints: list[int], values: np.ndarray, strides: list[int]) -> list[np.ndarray | None]:
        """Per joint None if all samples of its values (4, M) are accepted; else the grid rows of the peaks of violation
        with their neighbours, and of every `stride`th violated sample where the stride is not 0."""
        everyone = len(joints) == len(self.lower)
        lower, upper = (self.lower, self.upper) if everyone else (self.lower[joints], self.upper[joints])
        outside = values > upper
        outside |= values < lower
        found: list[np.ndarray | None] = []
        for n, joint in enumerate(joints):
            rows = np.flatnonzero(outside[n].ravel())
            rows = rows[self.problem.limited[joint].ravel()[rows]]
            value = values[n].ravel()[rows]
            over = np.maximum(value - upper[n].ravel()[rows], lower[n].ravel()[rows] - value)
            if np.any(over > self._spare(joint, rows)):
                found.append(_spread(rows, over, values.shape[2], strides[n]))
            else:
                found.append(None)
        return found

    def _spare(self, joint: int, rows: np.ndarray) -> np.ndarray:
        """How much further than `lower` and `upper` samples at the rows may go and be accepted."""
        problem = self.problem
        band = np.minimum(problem.lower_band[joint].ravel()[rows], problem.upper_band[joint].ravel()[rows])
        return (_ACCEPTED - _WORTH_ADDING) * band


def _spread(rows: np.ndarray, over: np.ndarray, count: int, stride: int) -> np.ndarray:
    """The rows at which `over` peaks with their neighbours, and every `stride`th."""
    sample = rows % count
    apart = (rows[1:] - rows[:-1] > 1) | (sample[1:] == 0)
    rises = np.concatenate([[True], apart | (over[1:] >= over[:-1])])
    falls = np.concatenate([apart | (over[:-1] >= over[1:]), [True]])
    peak = rises & falls
    near = sample[peak, None] + np.array([-PEAK_NEIGHBOURS, 0, PEAK_NEIGHBOURS])
    near = (rows - sample)[peak, None] + np.clip(near, 0, count - 1)
    every = rows[sample % stride == 0] if stride else rows[:0]
    return np.concatenate([near.ravel(), every])


class _WorkingSet:
    """One joint's rows in play, the point they lead to, and how to go on from there.

    In u = z − z0, where z0 meets the equalities and lies nearest to the target, the cost is |u|² and u runs in
    the null space of the equalities.
    """

    def __init__(self, grid: Grid, problem: Problem, joint: int, target: np.ndarray) -> None:
        self.grid, self.problem, self.joint = grid, problem, joint
        self.equalities, self.targets = problem.equalities[joint], problem.targets[joint]
        self.z0 = self.z = self.equalities.nearest(target, self.targets)
        self.limited = problem.limited[joint].reshape(-1)
        self.in_play = np.zeros(self.limited.size, dtype=bool)
        self.rows = np.zeros(0, dtype=int)
        self.extras: tuple[tuple[int, float], ...] = ()
        self.multipliers = np.zeros(0)
        self.rounds = self.row_count = self.mended = 0
        self.precision = "loose"
        self.certificate: Certificate | None = None

    def solution(self) -> Solution:
        """What was found; there is a certificate."""
        assert self.certificate is not None
        return Solution(self.z, self.rows, self.multipliers, self.rounds, self.row_count, self.certificate)

    def add(self, rows: np.ndarray) -> bool:
        """Take grid rows in; False if all of them were in already."""
        known = self.rows.size
        self.in_play[rows] = True
        self.in_play &= self.limited
        self.rows = np.flatnonzero(self.in_play)
        return self.rows.size > known

    def demand_more(self, rows: np.ndarray) -> None:
        """Solve again with the rows; with those in play but tight, if there are no others."""
        if self.add(rows):
            self.resolve("loose")
        elif self.precision == "loose":
            self.resolve("tight")
        else:
            raise SolverFailed(self.joint, "rows already demanded stay violated")

    def mend(self, failures: tuple[tuple[int, float], ...]) -> None:
        """Demand the samples on both sides of where a limit is passed between them, or, where they are
        demanded already, the very place."""
        self.mended += 1
        left = np.array([k * len(self.grid.s) + int(s * INTERVALS) for k, s in failures])
        if not self.add(np.concatenate([left, left + 1])):
            self.extras += failures

    def resolve(self, precision: str) -> None:
        """Solve for the rows in play. Raises Clash or SolverFailed."""
        self.precision = precision
        self.rounds += 1
        if self.rounds > MAX_ROUNDS:
            raise SolverFailed(self.joint, f"no end after {MAX_ROUNDS} rounds")
        matrix, lower, upper, quantity, s = self._constraints()
        size = max(np.max(lower, initial=0.0), np.max(-upper, initial=0.0))
        if size <= 0:
            self.z, self.multipliers = self.z0, np.zeros(len(self.rows))
            return
        u, multipliers, status = shortest_step(matrix, lower / size, upper / size, precision)
        multipliers = np.abs(multipliers)
        if status == "infeasible":
            sums = np.bincount(quantity, weights=multipliers, minlength=4)
            hardest = np.where(quantity == sums.argmax(), multipliers, -1.0).argmax()
            raise Clash(self.joint, int(sums.argmax()), float(s[hardest]))
        if status:
            raise SolverFailed(self.joint, status)
        self.z = self.equalities.nearest(self.z0 + u * size, self.targets)
        self.multipliers = multipliers[: len(self.rows)]
        self.row_count = len(quantity)

    def _constraints(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rows projected on the null space and of unit norm, their bounds on u, quantities and places."""
        matrix, quantity, s, lower, upper = self._raw_constraints()
        room = self.problem.duration ** quantity.astype(float)
        base = self.problem.offset(self.joint, quantity, s) + matrix @ self.z0 / room
        span = self.equalities.span
        matrix = matrix - (matrix @ span) @ span.T
        norms = np.sqrt(np.einsum("ij,ij->i", matrix, matrix))
        alive = norms > _DEAD * self.grid.norms[quantity]
        if not alive.all():
            # What the equalities alone decide was compared with the limits before.
            dead = self.rows[~alive[: len(self.rows)]]
            self.limited[dead] = self.in_play[dead] = False
            self.rows = np.flatnonzero(self.in_play)
            matrix, quantity, s, base = matrix[alive], quantity[alive], s[alive], base[alive]
            lower, upper, norms, room = lower[alive], upper[alive], norms[alive], room[alive]
        room /= norms
        return matrix / norms[:, None], (lower - base) * room, (upper - base) * room, quantity, s

    def _raw_constraints(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rows on z, their quantities and places, and the demanded bounds in physical units."""
        problem, grid, rows, count = self.problem, self.grid, self.rows, len(self.grid.s)
        places = np.array(self.extras).reshape(-1, 2)
        k, s = places[:, 0].astype(int), places[:, 1]
        # An extra place takes the bounds of the sample on its left.
        at = np.concatenate([rows, k * count + np.minimum((s * INTERVALS).astype(int), count - 2)])
        joint = self.joint
        lower = problem.lower[joint].flat[at] + problem.lower_band[joint].flat[at]
        upper = problem.upper[joint].flat[at] - problem.upper_band[joint].flat[at]
        matrix = grid.flat_rows[rows]
        if self.extras:
            between = [grid.rows_at(np.array([place]), quantity - 2) for quantity, place in self.extras]
            matrix = np.concatenate([matrix, *between])
        return matrix, at // count, np.concatenate([grid.s[rows % count], s]), lower, upper
