import numpy as np
import pytest

from motion import problem as problem_module
from motion.basis import make_grid
from motion.certificate import certify
from motion.limits import Limits
from motion.primitive import Primitive
from motion.problem import Problem, build
from motion.request import Boundary, MotionRequest
from motion.solver import solve

REST = np.zeros(1)


def posed(primitive: Primitive, limits: Limits) -> tuple[Problem, np.ndarray]:
    free = np.array([np.nan])
    start, goal = Boundary(REST, -np.ones(1), free), Boundary(np.ones(1), np.full(1, 3.0), free)
    request = MotionRequest(start, goal, 1.0, limits, tail="coast")
    grid = make_grid(primitive.basis_count)
    return build(grid, request, np.array([[-np.inf, np.inf]])), grid.whiten(primitive.theta.T).T


def tight() -> Limits:
    return Limits(np.array([[-1.3, 1.2]]), np.array([8.0]), np.array([90.0]), np.array([1900.0]))


def fine(problem: Problem, primitive: Primitive, z: np.ndarray, quantity: int) -> np.ndarray:
    grid = make_grid(primitive.basis_count)
    s = np.linspace(0, 1, 50001)
    values = grid.basis.rows(s, quantity - 2) @ grid.weights(z) / problem.duration**quantity
    return values + problem.offset(0, np.array(quantity), s)


def test_finds_the_peaks_between_samples(figure: Primitive) -> None:
    """Limits a hair below the curve's true peaks are not certified, a hair above they are."""
    grid = make_grid(figure.basis_count)
    free, target = posed(figure, Limits.unlimited(1))
    z = solve(grid, free, target)[0].z[None]
    values = free.values(grid, z, [0])
    [certificate] = certify(grid, free, [0], z, values)
    assert certificate.failures == ()
    for quantity in range(4):
        curve = fine(free, figure, z[0], quantity)
        low, high = certificate.extremes[quantity]
        assert (low, high) == pytest.approx((curve.min(), curve.max()), abs=3e-7 * np.ptp(curve))
        for side, peak in ((1, high), (0, low)):
            for hair, failures in ((1e-5, 0), (-1e-5, 1)):
                limits = [np.full_like(free.lower, -np.inf), np.full_like(free.upper, np.inf)]
                limits[side][0, quantity] = peak + (hair if side else -hair) * np.ptp(curve)
                limited = _with_limits(free, limits)
                found = certify(grid, limited, [0], z, values)[0].failures
                assert len(found) == failures, (quantity, side, hair)
                if found:
                    places = fine(free, figure, z[0], quantity)
                    at = found[0][1]
                    assert found[0][0] == quantity
                    place = (places.argmax() if side else places.argmin()) / 50000
                    assert at == pytest.approx(place, abs=2e-4)


def test_rows_between_samples_mend_what_the_grid_misses(figure: Primitive, monkeypatch: pytest.MonkeyPatch) -> None:
    """With hardly a band the curve peaks between samples; rows at the peaks make it certified all the same."""
    monkeypatch.setattr(problem_module, "BAND", 1.2e-5)
    grid = make_grid(figure.basis_count)
    problem, target = posed(figure, tight())
    [solution] = solve(grid, problem, target)
    assert solution.certificate.failures == ()
    for quantity in range(4):
        curve = fine(problem, figure, solution.z, quantity)
        assert curve.max() <= problem.upper[0, quantity].max() * (1 + 1e-9)
        assert curve.min() >= problem.lower[0, quantity].min() * (1 + 1e-9)
    assert solution.row_count > len(solution.rows)


def _with_limits(problem: Problem, limits: list[np.ndarray]) -> Problem:
    from dataclasses import replace

    return replace(problem, lower=limits[0], upper=limits[1])
