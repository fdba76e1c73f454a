"""The certificate against curves sampled fifty times finer than the grid."""

from dataclasses import replace

import numpy as np
import pytest

from motion import problem as problem_module
from motion.basis import make_grid
from motion.certificate import _hermite_peak, certify
from motion.fixed import fixed_values
from motion.limits import Limits
from motion.primitive import Primitive
from motion.problem import Problem, build
from motion.request import Boundary, MotionRequest
from motion.solver import solve

REST = np.zeros(1)
FIRST = np.array([0])


def posed(primitive: Primitive, limits: Limits) -> Problem:
    free = np.array([np.nan])
    start, goal = Boundary(REST, -np.ones(1), free), Boundary(np.ones(1), np.full(1, 3.0), free)
    request = MotionRequest(start, goal, 1.0, limits, tail="coast")
    grid = make_grid(primitive.basis_count)
    return build(grid, request, fixed_values(request), primitive.theta, np.array([[-np.inf, np.inf]]))


def tight() -> Limits:
    return Limits(np.array([[-1.3, 1.2]]), np.array([8.0]), np.array([90.0]), np.array([1900.0]))


def fine(primitive: Primitive, x: np.ndarray, quantity: int) -> np.ndarray:
    grid = make_grid(primitive.basis_count)
    s = np.linspace(0, 1, 50001)
    start = (x[-2] + x[-1] * s, x[-1], 0, 0)[quantity]
    return grid.basis.rows(s, quantity - 2) @ grid.weights(x[None])[0] + start


def test_finds_the_peaks_between_samples(figure: Primitive) -> None:
    """Limits a hair below the curve's true peaks are not certified, a hair above they are."""
    grid = make_grid(figure.basis_count)
    free = posed(figure, Limits.unlimited(1))
    [solution] = solve(grid, free)
    x, curves = solution.x[None], grid.curves(solution.x[None])
    [certificate] = certify(grid, free, FIRST, x, curves)
    assert certificate.failures == ()
    for quantity in range(4):
        curve = fine(figure, x[0], quantity)
        low, high = certificate.extremes[quantity]
        assert (low, high) == pytest.approx((curve.min(), curve.max()), abs=3e-7 * np.ptp(curve))
        for side, peak in ((1, high), (0, -low)):
            for hair, failures in ((1e-5, 0), (-1e-5, 1)):
                limit = np.full(free.limit.shape, np.inf)
                limit[side, 0, quantity] = peak + hair * np.ptp(curve)
                limited = replace(free, limit=limit, tightest=limit.min(axis=3))
                found = certify(grid, limited, FIRST, x, curves)[0].failures
                assert len(found) == failures, (quantity, side, hair)
                if found:
                    [failure] = found
                    assert (failure.side, failure.quantity) == (side, quantity)
                    assert failure.overshoot == pytest.approx(1e-5 * np.ptp(curve), rel=0.1)
                    at = (curve.argmax() if side else curve.argmin()) / 50
                    assert failure.sample <= at + 0.5
                    assert at - 0.5 <= failure.sample + 1


def test_rows_further_inside_mend_what_the_grid_misses(figure: Primitive, monkeypatch: pytest.MonkeyPatch) -> None:
    """With hardly a band the curve peaks between samples; rows demanded further inside make it certified."""
    monkeypatch.setattr(problem_module, "BAND", 1.2e-5)
    grid = make_grid(figure.basis_count)
    problem = posed(figure, tight())
    [solution] = solve(grid, problem)
    assert solution.certificate.failures == ()
    for quantity in range(4):
        curve = fine(figure, solution.x, quantity)
        assert curve.max() <= problem.limit[1, 0, quantity].max() * (1 + 1e-9)
        assert -curve.min() <= problem.limit[0, 0, quantity].max() * (1 + 1e-9)
    assert solution.further


def test_the_height_of_a_cubic() -> None:
    """Of cubics of every kind: with slopes of either sign or none at their ends, with and without a peak between."""
    rng = np.random.default_rng(4)
    f0, f1, d0, d1 = rng.choice([0.0, 1e-18, -1e-18, 1e-12, 0.3, -0.3, 1.0, -1.0, 7.0], size=(4, 20000))
    x = np.linspace(0, 1, 2001)[:, None]
    b, c = 3 * (f1 - f0) - 2 * d0 - d1, d0 + d1 - 2 * (f1 - f0)
    sampled = (f0 + x * (d0 + x * (b + x * c))).max(axis=0)
    assert np.abs(_hermite_peak(f0, f1, d0, d1) - sampled).max() < 1e-5
