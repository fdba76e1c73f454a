"""The spline space, its metric and its hulls compared with quadrature and fine sampling."""

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.interpolate import BSpline

from motion import splines
from motion.program.curves import curves_along, curves_of, extremes, trajectory_of
from motion.program.space import make_hull, make_space

S = np.linspace(0, 1, 20_001)


def test_gram_agrees_with_quadrature_and_is_well_conditioned() -> None:
    psi = splines.rows(50, 3, S)
    products = psi[:, :, None] * psi[:, None, :5]
    assert np.abs(simpson(products, x=S, axis=0) - splines.gram(50, 3)[:, :5]).max() < 1e-9
    assert np.linalg.cond(splines.gram(50, 3)) == pytest.approx(27, abs=1)


@pytest.mark.parametrize("count", [20, 50])
@pytest.mark.parametrize("stiffness", [0.0, 2.0, 8.0])
def test_whitened_weights_measure_the_cost(count: int, stiffness: float) -> None:
    """|z − z'|² = ∫(g″ − g'″)² + κ⁴∫(g − g')² for two motions from the same start."""
    space = make_space(count, stiffness)
    w = np.random.default_rng(1).normal(size=count)
    x = np.concatenate([space.whitened(w[None])[0], [0.0, 0.0]])
    assert space.weights(x[None, :-2])[0] == pytest.approx(w, abs=1e-10)
    position, acceleration = (space.rows_at(k, S) @ x for k in (0, 2))
    cost = simpson(acceleration**2 + stiffness**4 * position**2, x=S)
    assert x[:-2] @ x[:-2] == pytest.approx(cost, rel=1e-9)


@pytest.mark.parametrize("count", [5, 20, 50])
def test_rows_are_positions_and_their_derivatives(count: int) -> None:
    space = make_space(count, 2.0)
    x = np.random.default_rng(2).normal(size=count + 2)
    acceleration = splines.rows(count, 3, S) @ space.weights(x[None, :-2])[0]
    assert space.rows_at(2, S) @ x == pytest.approx(acceleration, abs=1e-12 * np.abs(acceleration).max())
    for quantity in (0, 1, 2):
        values, slopes = space.rows_at(quantity, S) @ x, space.rows_at(quantity + 1, S) @ x
        risen = values[0] + np.concatenate([[0], np.cumsum((slopes[1:] + slopes[:-1]) / 2) * S[1]])
        assert np.abs(risen - values).max() < 1e-6 * np.abs(slopes).max()
    assert space.rows_at(0, np.zeros(1)) @ x == pytest.approx([x[-2]])
    assert space.rows_at(1, np.zeros(1)) @ x == pytest.approx([x[-1]])
    assert splines.rows(count + 2, 5, S) @ space.positions(x[None])[0] == pytest.approx(space.rows_at(0, S) @ x)


@pytest.mark.parametrize("refinement", [1, 3, 16])
@pytest.mark.parametrize("touched", [(), (0.5,), (0.313, 0.71)])
def test_curves_lie_in_their_hulls(refinement: int, touched: tuple[float, ...]) -> None:
    space = make_space(20, 2.0)
    hull = make_hull(space, refinement, touched)
    assert len(hull.s) == len(hull.rows) == len(hull.quantity) == len(hull.ceases)
    assert (np.diff(hull.quantity) >= 0).all()
    x = np.random.default_rng(3).normal(size=22)
    points = hull.rows @ x
    for quantity in range(4):
        own = hull.quantity == quantity
        curve = space.rows_at(quantity, S) @ x
        assert curve.max() <= points[own].max() + 1e-12 * np.ptp(curve)
        assert curve.min() >= points[own].min() - 1e-12 * np.ptp(curve)
        # Refined control points lie near the curve at their abscissae.
        away = np.abs(points[own] - np.interp(hull.s[own], S, curve)).max() / np.ptp(curve)
        assert away < (2.0, 0.3, 0.02)[(1, 3, 16).index(refinement)]
        for place in touched:
            there = space.rows_at(quantity, np.array([place])) @ x
            assert np.abs(points[own] - there).min() < 1e-10 * np.ptp(curve)


@pytest.mark.parametrize("refinement", [1, 3])
def test_a_control_point_has_no_influence_behind_its_support(refinement: int) -> None:
    """`ceases` is at most degree + 1 knot intervals behind the abscissa."""
    space = make_space(20, 2.0)
    hull = make_hull(space, refinement)
    degree = 5 - hull.quantity
    assert (hull.ceases > hull.s - 1e-12).all()
    width = 1 / (17 * refinement)
    assert (hull.ceases <= hull.s + (degree + 1) * width + 1e-12).all()


@pytest.mark.parametrize("seed", range(12))
def test_extremes_agree_with_fine_sampling(seed: int) -> None:
    """For random waves, a constant, a line, and a curve with its peak on a knot."""
    rng = np.random.default_rng(seed)
    waves = rng.uniform(1, 25, (5, 6, 1)) * splines.greville(30, 5) + rng.uniform(0, 6, (5, 6, 1))
    points = (rng.normal(size=(5, 6, 1)) * np.sin(waves)).sum(axis=1)
    points[1] = 0.3
    points[2] = splines.greville(30, 5)
    points[3] = -np.abs(np.arange(30) - 14.5)
    curves = curves_of(points)
    found = extremes(curves, 1.0)
    fine = np.linspace(0, 1, 100_001)
    for quantity in range(4):
        curve = splines.derivative(points, fine, quantity)
        low, high = found[:, quantity].T
        scale = np.ptp(curve, axis=0) + 1e-9
        rounding = 1e-12 * np.abs(points).max() * 25.0**quantity
        assert np.all(np.abs(low - curve.min(axis=0)) < 2e-6 * scale + rounding)
        assert np.all(np.abs(high - curve.max(axis=0)) < 2e-6 * scale + rounding)
        assert np.all(low > curve.min(axis=0) - 1e-7 * scale - rounding)
        assert np.all(high < curve.max(axis=0) + 1e-7 * scale + rounding)
    assert curves == pytest.approx(curves_along(trajectory_of(curves, 1.0)), abs=1e-12)
    assert curves[:, 0] == pytest.approx(splines.derivative(points, np.linspace(0, 1, 76), 0).T, abs=1e-12)


@pytest.mark.parametrize("count", [7, 22, 52, 402])
def test_trajectories_agree_with_scipys_splines(count: int) -> None:
    """On both sides of every knot, for a duration other than 1 s."""
    points = np.random.default_rng(count).normal(size=(3, count))
    trajectory = trajectory_of(curves_of(points), 2.5)
    assert trajectory.coefficients.shape == (count - 5, 3, 6)
    curve = BSpline(splines.knots(count, 5), points.T, 5)
    s = np.linspace(0, 1, 7 * (count - 5) + 1)
    s = np.concatenate([s, s[1:] - 1e-12])
    for order, values in enumerate(trajectory.derivatives(2.5 * s, 5)):
        exact = curve(s, order) / 2.5**order
        assert np.abs(values - exact).max() < (1e-11, 1e-7)[order == 4] * np.abs(exact).max(), order
