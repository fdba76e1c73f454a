"""One joint's problem formulated independently in seconds, with scipy's B-splines and separate quadrature."""

import math
from functools import cache, cached_property

import numpy as np
from scipy.interpolate import BSpline

from motion.plan import SplinePlan
from motion.primitive import Primitive
from motion.request import MotionRequest
from tests.property.motion.independent import smallest_step

INSTANTS = 4001
"""Number of instants at which limits apply. They bind less than limits at all times, so the optimum costs no more."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


def knots(count: int, degree: int, end: float = 1.0) -> np.ndarray:
    """Return clamped uniform knots over [0, end]."""
    return np.concatenate([np.zeros(degree), np.linspace(0, end, count - degree + 1), np.full(degree, end)])


def curve_of(control_points: np.ndarray, end: float) -> BSpline:
    """Return the positions over [0, end] s of control points (N + 2,) or (J, N + 2)."""
    points = np.atleast_2d(control_points).T
    return BSpline(knots(len(points), 5, end), points, 5)


@cache
def integrals(count: int) -> list[BSpline]:
    """Return position, velocity, acceleration and jerk over [0, 1] for each unit weight of the acceleration."""
    acceleration = BSpline(knots(count, 3), np.eye(count), 3)
    velocity = acceleration.antiderivative()
    return [velocity.antiderivative(), velocity, acceleration, acceleration.derivative()]


@cache
def rows_at_instants(count: int) -> list[np.ndarray]:
    """Return the values (INSTANTS, N) of these `integrals`."""
    return [spline(np.linspace(0, 1, INSTANTS)) for spline in integrals(count)]


class InSeconds:
    """The moving part of a request of one joint: the weights of the acceleration in t are the unknowns.

    The cost is ∫(g̈ − d̈)² + (κ/T)⁴∫(g − g*)² dt, where g* is the optimum without limits of ∫(g̈ − d̈)² dt, or with a
    `place_time` ∫(g̈ − d̈)² + (κ/T)⁴∫(g − d)² dt. κ/T: `stiffness` (1/s).
    """

    def __init__(self, primitive: Primitive, request: MotionRequest, stiffness: float) -> None:
        self.request, self.end, self.local = request, request.moving_duration, request.place_time is not None
        self.stiffness, self.count = stiffness, primitive.basis_count
        begin, end = request.phase, request.phase + (1 - request.phase) * (1 - request.rest_fraction)
        rate = (end - begin) / self.end
        shown = curve_of(primitive.control_points[0], 1.0)
        # Between the knots of both curves everything is a polynomial.
        own, theirs = np.linspace(0, self.end, self.count - 2), (np.linspace(0, 1, self.count - 2) - begin) / rate
        breaks = np.unique(np.concatenate([own, theirs[(theirs > 0) & (theirs < self.end)]]))
        half = np.diff(breaks)[:, None] / 2
        self.t = (breaks[:-1, None] + half * (NODES + 1)).ravel()
        self.dt = (half * WEIGHTS).ravel()
        self.shown = np.stack([shown(begin + rate * self.t, k)[:, 0] * rate**k for k in range(3)])
        self.bends, self.places = (self.at(quantity, self.t) for quantity in (2, 0))

    def at(self, quantity: int, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows (n, N) of a quantity on the weights at t (n,), and the start's contributions (n,)."""
        # The weights are accelerations in t, so each integral over t brings a factor T.
        rows = self.end ** (2 - quantity) * integrals(self.count)[quantity](t / self.end)
        return rows, self.given(quantity, t)

    def given(self, quantity: int, t: np.ndarray) -> np.ndarray:
        """Return the contributions of the start's position and velocity to a quantity at t (n,)."""
        p, v = self.request.start.positions[0], self.request.start.velocities[0]
        return (p + v * t, np.full(len(t), v), np.zeros(len(t)), np.zeros(len(t)))[quantity]

    @cached_property
    def fixed(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the prescribed values: rows on the weights, and targets."""
        request, rows, targets = self.request, [], []

        def fix(quantity: int, t: float, value: float) -> None:
            if not np.isnan(value):
                row, given = self.at(quantity, np.array([t]))
                rows.append(row[0])
                targets.append(value - given[0])

        fix(2, 0.0, request.start.accelerations[0])
        for waypoint in request.waypoints:
            fix(0, waypoint.time_from_start, waypoint.positions[0])
            fix(1, waypoint.time_from_start, waypoint.velocities[0])
        straight = request.rest_fraction * request.duration * request.goal.velocities[0]
        fix(0, self.end, request.goal.positions[0] - straight)
        fix(1, self.end, request.goal.velocities[0])
        fix(2, self.end, request.final_accelerations[0])
        return np.array(rows), np.array(targets)

    def _gram(self, stiffness: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the matrix (N, N) of ∫g̈² + k⁴∫g², and the products (N,) with the demonstration."""
        (bends, _), (places, given) = self.bends, self.places
        matrix = (bends.T * self.dt) @ bends + stiffness**4 * (places.T * self.dt) @ places
        towards = bends.T @ (self.dt * self.shown[2]) + stiffness**4 * places.T @ (self.dt * (self.shown[0] - given))
        return matrix, towards

    @cached_property
    def unlimited(self) -> np.ndarray:
        """Return the best weights (N,) without limits, from the optimality conditions."""
        matrix, towards = self._gram(self.stiffness if self.local else 0.0)
        rows, targets = self.fixed
        zero = np.zeros((len(rows), len(rows)))
        scale = np.trace(matrix) / len(matrix)
        unit = rows / np.linalg.norm(rows, axis=1)[:, None]
        kkt = np.block([[matrix / scale, unit.T], [unit, zero]])
        right = np.concatenate([towards / scale, targets / np.linalg.norm(rows, axis=1)])
        return np.linalg.solve(kkt, right)[: len(matrix)]

    def optimum(self, inside: float = 0.0) -> np.ndarray | None:
        """Return the best weights (N,) that keep every limit at the `INSTANTS`, None if it is infeasible.

        inside: distance from each limit, as a part of its range; prescribed values are exempt. Raises Inconclusive.
        """
        rows, _ = self.fixed
        factor = np.linalg.cholesky(self._gram(self.stiffness)[0])
        full, r = np.linalg.qr(np.linalg.solve(factor, rows.T), mode="complete")
        null = np.linalg.solve(factor.T, full[:, r.shape[1] :])
        ranges = self.request.limits.ranges[0]
        ranges = ranges + inside * np.diff(ranges) * [1, -1]
        at_instants, instants = rows_at_instants(self.count), np.linspace(0, self.end, INSTANTS)
        demands, lower, upper = [], [], []
        for quantity in range(4):
            if not np.isfinite(ranges[quantity]).any():
                continue
            on_weights = self.end ** (2 - quantity) * at_instants[quantity]
            given = self.given(quantity, instants)
            row, value = on_weights @ null, on_weights @ self.unlimited + given
            norms = np.linalg.norm(row, axis=1)
            # Prescribed values leave no freedom: their rows do not constrain the remaining weights.
            free = norms > 1e-7 * norms.max()
            demands.append(row[free])
            lower.append((ranges[quantity, 0] - value)[free])
            upper.append((ranges[quantity, 1] - value)[free])
        step = smallest_step(np.concatenate(demands), np.concatenate(lower), np.concatenate(upper))
        return None if step is None else self.unlimited + null @ step

    def beyond(self, weights: np.ndarray) -> float:
        """Return the cost of weights (N,) that satisfy the equalities, minus that of the optimum without limits."""
        away = weights - self.unlimited
        return float(away @ self._gram(self.stiffness)[0] @ away)

    def cost(self, weights: np.ndarray) -> float:
        """Return the total cost, that of the optimum without limits included.

        Its place term is 0 without `place_time`.
        """
        least = self.missed(self.unlimited) ** 2 * self.end
        if self.local:
            places, given = self.places
            apart = places @ self.unlimited + given - self.shown[0]
            least += self.stiffness**4 * float(self.dt @ apart**2)
        return least + self.beyond(weights)

    def missed(self, weights: np.ndarray) -> float:
        """Return the root mean square of g̈ − d̈ over the moving part, rad/s²."""
        return math.sqrt(self.dt @ (self.bends[0] @ weights - self.shown[2]) ** 2 / self.end)

    def positions(self, weights: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return the positions (n,), rad, at t (n,)."""
        rows, given = self.at(0, t)
        return rows @ weights + given

    def weights_of(self, planned: SplinePlan, joint: int = 0) -> np.ndarray:
        """Return a plan's weights: the control points (N,) of its acceleration."""
        accelerations = curve_of(planned.control_points[joint], self.end).derivative(2)
        return accelerations.c[: self.count, 0]
