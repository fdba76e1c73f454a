"""Row generation: the few limit rows that matter, found by solving, looking and adding (design 1.5, 1.7)."""

from dataclasses import dataclass

import numpy as np
import piqp

from motion.basis import INTERVALS, Grid
from motion.certificate import Certificate, certify
from motion.errors import SolverFailed
from motion.problem import JointProblem

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
_TOLERANCES = {"loose": 1e-7, "tight": 1e-10}
_UNREACHED = 1e6


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
        return self.rows[self.multipliers > 1e-5 * max(self.multipliers.max(), 1e-300)]


def solve(grid: Grid, problem: JointProblem, target: np.ndarray, warm: np.ndarray | None = None) -> Solution:
    """The weights nearest to `target` (N,) that meet the equalities and all limits, certified where possible.

    `warm` are grid rows to start with. Raises Clash where the rows are infeasible, SolverFailed for numerical
    trouble.
    """
    work = _WorkingSet(grid, problem, target)
    if warm is not None and warm.size:
        work.add(warm)
        work.resolve("loose")
    extra_rounds = 0
    while work.rounds < MAX_ROUNDS:
        new = work.violated(FIRST_STRIDE if not work.rows.size else 0)
        if new.size:
            if work.add(new):
                work.resolve("loose")
            elif work.precision == "loose":
                work.resolve("tight")
            else:
                raise SolverFailed(problem.joint, "rows already demanded stay violated")
            continue
        certificate = certify(grid, problem, work.z, work.values)
        if not certificate.failures or extra_rounds == MAX_CERTIFICATE_ROUNDS:
            return Solution(work.z, work.rows, work.multipliers, work.rounds, work.row_count, certificate)
        extra_rounds += 1
        work.mend(certificate.failures)
        work.resolve("tight")
    raise SolverFailed(problem.joint, f"no end after {MAX_ROUNDS} rounds")


class _WorkingSet:
    """The rows in play, the point they lead to, and how to go on from there.

    In u = z − z0, where z0 meets the equalities and lies nearest to the target, the cost is |u|² and u runs in
    the null space of the equalities, whose complement Q1 spans.
    """

    def __init__(self, grid: Grid, problem: JointProblem, target: np.ndarray) -> None:
        self.grid, self.problem = grid, problem
        self.rows = np.zeros(0, dtype=int)
        self.extras: tuple[tuple[int, float], ...] = ()
        self.multipliers = np.zeros(0)
        self.rounds = self.row_count = 0
        self.precision = "loose"
        norms = np.linalg.norm(problem.equalities, axis=1)
        self.q1, r1 = np.linalg.qr((problem.equalities / norms[:, None]).T)
        if np.abs(np.diag(r1)).min() < 1e-10:
            raise SolverFailed(problem.joint, "the fixed values depend on each other")
        self.coordinates = np.linalg.solve(r1.T, problem.targets / norms)
        self.z0 = self.z = self._onto_equalities(target)
        self.base = self.values = problem.values(grid, self.z0)
        self.demand_lower = problem.lower + problem.lower_band
        self.demand_upper = problem.upper - problem.upper_band
        self.ignored = np.zeros(self.base.size, dtype=bool)

    def _onto_equalities(self, z: np.ndarray) -> np.ndarray:
        """The nearest point that meets the equalities; twice, so that they hold to rounding."""
        for _ in range(2):
            residual = self.coordinates - self.q1.T @ z
            z = z + self.q1 @ residual
        return z

    def violated(self, stride: int) -> np.ndarray:
        """Grid rows to add: none if every sample is accepted, else the peaks and their neighbours, and every
        `stride`th violated sample."""
        problem = self.problem
        self.values = self.base if self.z is self.z0 else problem.values(self.grid, self.z)
        over, under = self.values - self.demand_upper, self.demand_lower - self.values
        passed = np.maximum(over - _ACCEPTED * problem.upper_band, under - _ACCEPTED * problem.lower_band)
        passed -= _ROUNDING * problem.half_range
        passed.reshape(-1)[self.ignored] = -np.inf
        if passed.max() <= 0:
            return np.zeros(0, dtype=int)
        worth = np.maximum(over - _WORTH_ADDING * problem.upper_band, under - _WORTH_ADDING * problem.lower_band)
        worth /= problem.half_range
        worth.reshape(-1)[self.ignored] = -np.inf
        return _peaks(worth, _ROUNDING, stride)

    def add(self, rows: np.ndarray) -> bool:
        """Take grid rows in; False if all of them were in already."""
        known = len(self.rows)
        bounded = np.isfinite(self.demand_lower.flat[rows]) | np.isfinite(self.demand_upper.flat[rows])
        self.rows = np.union1d(self.rows, rows[bounded & ~self.ignored[rows]])
        return len(self.rows) > known

    def mend(self, failures: tuple[tuple[int, float], ...]) -> None:
        """Demand the samples on both sides of where a limit is passed between them, or, where they are
        demanded already, the very place."""
        left = np.array([k * len(self.grid.s) + int(s * INTERVALS) for k, s in failures])
        if not self.add(np.concatenate([left, left + 1])):
            self.extras += failures

    def resolve(self, precision: str) -> None:
        """Solve for the rows in play. Raises Clash or SolverFailed."""
        self.precision = precision
        self.rounds += 1
        matrix, lower, upper, quantity, s = self._constraints()
        size = max(np.max(lower, initial=0.0), np.max(-upper, initial=0.0))
        if size <= 0:
            self.z, self.multipliers = self.z0, np.zeros(len(self.rows))
            return
        q, r = np.linalg.qr(matrix.T)
        x, multipliers, status = _solve_box(r.T, lower / size, upper / size, precision)
        if status == "infeasible":
            signed = np.abs(multipliers)
            sums = np.bincount(quantity, weights=signed, minlength=4)
            raise Clash(self.problem.joint, int(sums.argmax()), float(s[_argmax_of(signed, quantity, sums)]))
        if status:
            raise SolverFailed(self.problem.joint, status)
        self.z = self._onto_equalities(self.z0 + q @ x * size)
        self.multipliers = np.abs(multipliers[: len(self.rows)])
        self.row_count = len(quantity)

    def _constraints(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rows projected on the null space and of unit norm, their bounds on u, quantities and places."""
        matrix, lower, upper, quantity, s = self._raw_constraints()
        matrix = matrix - (matrix @ self.q1) @ self.q1.T
        norms = np.linalg.norm(matrix, axis=1)
        alive = norms > _DEAD * self.grid.norms[quantity]
        on_grid = alive[: len(self.rows)]
        # What the equalities alone decide was compared with the limits before.
        self.ignored[self.rows[~on_grid]] = True
        self.rows = self.rows[on_grid]
        scale = self.problem.duration ** quantity[alive] / norms[alive]
        return (
            matrix[alive] / norms[alive, None],
            lower[alive] * scale,
            upper[alive] * scale,
            quantity[alive],
            s[alive],
        )

    def _raw_constraints(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rows on z and the room that is left from z0 to the demanded bounds, in physical units."""
        count, rows, grid = len(self.grid.s), self.rows, self.grid
        quantity = rows // count
        matrix = grid.rows[:4].reshape(4 * count, -1)[rows]
        lower = self.demand_lower.flat[rows] - self.base.flat[rows]
        upper = self.demand_upper.flat[rows] - self.base.flat[rows]
        s = grid.s[rows % count]
        for k, place in self.extras:
            row = grid.rows_at(np.array([place]), k - 2)
            left = min(int(place * INTERVALS), count - 2)
            offset = np.interp(place, grid.s, self.problem.offsets[k])
            base = offset + row[0] @ self.z0 / self.problem.duration**k
            matrix = np.concatenate([matrix, row])
            lower = np.append(lower, self.demand_lower[k, left] - base)
            upper = np.append(upper, self.demand_upper[k, left] - base)
            quantity, s = np.append(quantity, k), np.append(s, place)
        return matrix, lower, upper, quantity, s


def _solve_box(
    matrix: np.ndarray, lower: np.ndarray, upper: np.ndarray, precision: str
) -> tuple[np.ndarray, np.ndarray, str]:
    """min ½|x|² with lower ≤ matrix·x ≤ upper: x, multipliers and "" or what went wrong.

    Anything but an optimum is tried once more, tight, by a fresh solver.
    """
    lower = np.where(lower < -_UNREACHED, -np.inf, lower)
    upper = np.where(upper > _UNREACHED, np.inf, upper)
    size = matrix.shape[1]
    status, multipliers = "", np.zeros(len(lower))
    for tolerance in {"loose": ("loose", "tight"), "tight": ("tight",)}[precision]:
        solver = piqp.DenseSolver()
        settings = solver.settings
        # Good solves take 22 iterations or fewer; the second try may take longer and scales its rows.
        settings.max_iter = 60 if tolerance == "loose" else 250
        if tolerance == "loose":
            settings.preconditioner_iter = 0
        settings.eps_abs = settings.eps_duality_gap_abs = _TOLERANCES[tolerance]
        settings.eps_rel = settings.eps_duality_gap_rel = _TOLERANCES[tolerance] / 10
        solver.setup(np.eye(size), np.zeros(size), None, None, np.asfortranarray(matrix), lower, upper)
        outcome = solver.solve()
        multipliers = solver.result.z_u - solver.result.z_l
        if outcome == piqp.PIQP_SOLVED and np.isfinite(solver.result.x).all():
            return solver.result.x.copy(), multipliers, ""
        status = "infeasible" if outcome == piqp.PIQP_PRIMAL_INFEASIBLE else outcome.name
    return np.zeros(size), multipliers, status


def _peaks(worth: np.ndarray, threshold: float, stride: int) -> np.ndarray:
    """Flat indices of local maxima above the threshold with their neighbours, per quantity."""
    padded = np.pad(worth, ((0, 0), (1, 1)), constant_values=-np.inf)
    above = worth > threshold
    picked = above & (worth >= padded[:, :-2]) & (worth >= padded[:, 2:])
    quantity, sample = np.nonzero(picked)
    spread = sample[:, None] + np.array([-PEAK_NEIGHBOURS, 0, PEAK_NEIGHBOURS])
    count = worth.shape[1]
    flat = np.clip(spread, 0, count - 1) + quantity[:, None] * count
    if stride:
        every = np.zeros_like(above)
        every[:, ::stride] = above[:, ::stride]
        return np.union1d(flat, np.flatnonzero(every))
    return np.unique(flat)


def _argmax_of(weights: np.ndarray, quantity: np.ndarray, sums: np.ndarray) -> int:
    """Index of the largest weight within the quantity of the largest sum."""
    return int(np.where(quantity == sums.argmax(), weights, -1.0).argmax())
