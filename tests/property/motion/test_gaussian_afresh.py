"""The paper's program in normalised time, compared with an independent formulation in seconds, solved by DAQP."""

from dataclasses import replace

import numpy as np
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

from motion.errors import SolverFailed
from motion.gaussian import BASIS_COUNT, optimum, plan_gaussian
from motion.gaussian_basis import WIDTH
from motion.gaussian_program import INSTANTS, make_programs
from motion.limits import Limits
from motion.primitive import Primitive
from motion.program.contradiction import InfeasibleRows
from motion.request import MotionRequest
from tests.property.motion.independent import nearest_to_zero
from tests.property.motion.random_goals import in_other_time, make_primitive, random_request

seeds = st.integers(0, 2**32 - 1)
FINER = 4
SAME = 1e-9
"""A value this close to its limit, as a part of the range, counts as on it."""


class Afresh:
    """Eq. 8–17 of one joint in t: Gaussians over [0, T], their integrals by quadrature, limits in physical units.

    The unknowns are the weights of the acceleration in t. `curves` (4, n, N) map them to position, velocity,
    acceleration and jerk at `t`; `start` (4, n) are the start's contributions. Limits apply at every fourth time.
    """

    def __init__(self, primitive: Primitive, request: MotionRequest) -> None:
        self.request = request
        duration = request.duration
        self.centres = np.linspace(0, duration, BASIS_COUNT)
        self.width = WIDTH * duration / (BASIS_COUNT - 1)
        self.t = np.linspace(0, duration, FINER * (len(INSTANTS) - 1) + 1)
        psi = self._psi(self.t)
        middle = self._psi((self.t[1:] + self.t[:-1]) / 2)
        step = self.t[1]
        velocity = np.zeros_like(psi)
        velocity[1:] = np.cumsum((psi[:-1] + 4 * middle + psi[1:]) * step / 6, axis=0)
        # ∫∫ over a step: v₀h + h²(a₀ + 2aₘ)/6, Simpson's rule for ∫(h − t)a dt.
        position = np.zeros_like(psi)
        position[1:] = np.cumsum(velocity[:-1] * step + step**2 * (psi[:-1] + 2 * middle) / 6, axis=0)
        jerk = -(self.t[:, None] - self.centres) / self.width**2 * psi
        self.curves = np.array([position, velocity, psi, jerk])
        p, v = request.start.positions[0], request.start.velocities[0]
        self.start = np.zeros((4, len(self.t)))
        self.start[0], self.start[1] = p + v * self.t, v
        shown = primitive.sample(self.t / duration).accelerations[:, 0]
        self.wanted = (primitive.duration / duration) ** 2 * shown
        weights = np.ones(len(self.t))
        weights[1:-1:2], weights[2:-1:2] = 4, 2
        self.simpson = weights * step / 3

    def _psi(self, t: np.ndarray) -> np.ndarray:
        return np.exp(-(((t[:, None] - self.centres) / self.width) ** 2) / 2)

    def cost(self, w: np.ndarray) -> float:
        """Eq. 10: ∫(g̈ − τ²d̈)² dt."""
        return float(self.simpson @ (self.curves[2] @ w - self.wanted) ** 2)

    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        """What the request fixes: rows on the weights and targets."""
        request, rows, targets = self.request, [], []

        def fix(quantity: int, t: float, value: float) -> None:
            if not np.isnan(value):
                rows.append(_at(self.t, self.curves[quantity], t))
                targets.append(value - _at(self.t, self.start[quantity], t))

        fix(2, 0.0, request.start.accelerations[0])
        positions, velocities = request.limits.ranges[0, :2]
        for waypoint in request.waypoints:
            t, position, velocity = waypoint.time_from_start, waypoint.positions[0], waypoint.velocities[0]
            if np.isnan(velocity) and _on_end(position, positions):
                velocity = 0.0  # on a limit the motion can only turn, between two of the limits' instants too
            fix(0, t, position)
            fix(1, t, velocity)
            if _on_end(velocity, velocities):
                fix(2, t, 0.0)
        fix(0, request.duration, request.goal.positions[0])
        fix(1, request.duration, request.goal.velocities[0])
        fix(2, request.duration, request.final_accelerations[0])
        return np.array(rows), np.array(targets)

    def optimum(self, limited: bool) -> np.ndarray | None:
        """Return the best weights inside every limit at 1001 instants, or without limits; None if it is infeasible.

        In whitened weights the cost is a distance. Prescribed values are eliminated, so the solver gets inequalities
        alone.
        """
        scaled = self.curves[2] * np.sqrt(self.simpson)[:, None]
        factor = np.linalg.cholesky(scaled.T @ scaled)
        fixed, targets = self.fixed()
        full, r = np.linalg.qr(np.linalg.solve(factor, fixed.T), mode="complete")
        span, null = full[:, : len(targets)], full[:, len(targets) :]
        towards = np.linalg.solve(factor, self.curves[2].T @ (self.simpson * self.wanted))
        nearest = towards + span @ (np.linalg.solve(r[: len(targets)].T, targets) - span.T @ towards)
        back = np.linalg.solve(factor.T, np.column_stack([nearest, null]))
        if not limited:
            return back[:, 0]
        instants = self.curves[:, ::FINER] @ back
        values = instants[..., 0] + self.start[:, ::FINER]
        lower, upper = self.request.limits.ranges[0].T[:, :, None] - values
        rows = instants[..., 1:].reshape(-1, null.shape[1])
        norms = np.linalg.norm(rows, axis=1)
        # Prescribed values leave no freedom: their rows do not constrain the remaining weights.
        free = norms > 1e-7 * norms.reshape(4, -1).max(axis=1).repeat(len(INSTANTS))
        u = nearest_to_zero(rows[free], lower.ravel()[free], upper.ravel()[free])
        return None if u is None else back @ np.append(1.0, u)


def _on_end(value: float, ends: np.ndarray) -> bool:
    """Return whether a value lies on one of the ends (2,) of its range."""
    width = float(np.ptp(ends))
    return bool(np.isfinite(width) and np.abs(ends - value).min() <= SAME * width)


def _at(t: np.ndarray, values: np.ndarray, when: float) -> np.ndarray:
    """Return the values (n, …) at any times: the quintic through six neighbours."""
    first = int(np.clip(np.searchsorted(t, when) - 3, 0, len(t) - 6))
    near = slice(first, first + 6)
    return make_interp_spline(t[near], values[near], k=5)(when)


def drawn(seed: int) -> tuple[Primitive, MotionRequest]:
    """Return a random goal without a rest fraction, in another duration than its demonstration's."""
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng)
    request = random_request(rng, primitive)
    assume(request.rest_fraction == 0)
    return primitive, in_other_time(request, rng.uniform(0.3, 3.0))


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_without_limits_the_trajectory_is_the_one_built_afresh(seed: int) -> None:
    primitive, request = drawn(seed)
    request = replace(request, limits=Limits.unlimited(1))
    afresh = Afresh(primitive, request)
    w = afresh.optimum(limited=False)
    assert w is not None
    expected = afresh.start[0] + afresh.curves[0] @ w
    found = plan_gaussian(primitive, request).sample(afresh.t).positions[:, 0]
    assert np.abs(found - expected).max() < 1e-7 * np.ptp(expected)


@settings(max_examples=15, deadline=None)
@example(213593)  # a waypoint on a limit
@given(seeds)
def test_with_limits_the_optimum_is_the_one_built_afresh(seed: int) -> None:
    """The costs agree, as both solvers keep the limits only to their tolerances."""
    primitive, request = drawn(seed)
    program = make_programs(primitive, request, BASIS_COUNT)[0]
    afresh = Afresh(primitive, request)
    try:
        w = optimum(program, 0) / request.duration**2
    except InfeasibleRows:
        assert afresh.optimum(limited=True) is None
        return
    except SolverFailed:  # one goal in sixty is close to infeasible
        assume(False)
        raise
    expected = afresh.optimum(limited=True)
    assert expected is not None
    assert abs(afresh.cost(w) / afresh.cost(expected) - 1) < 1e-5
