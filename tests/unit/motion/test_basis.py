"""Closed forms against quadrature and finite differences."""

import numpy as np
import pytest
from scipy.integrate import quad, simpson

from motion.basis import make_basis, make_grid


@pytest.mark.parametrize("count", [10, 50])
def test_integrals_agree_with_quadrature(count: int) -> None:
    basis = make_basis(count)
    for s in (0.013, 0.5, 1.0):
        for order in (-1, -2):
            row = basis.rows(np.array([s]), order)[0]
            for i in (0, count // 3, count - 1):
                centre = float(basis.centres[i])

                def below(u: float, i: int = i, order: int = order) -> float:
                    return float(basis.rows(np.array([u]), order + 1)[0, i])

                near = [p for p in (centre - 0.05, centre, centre + 0.05) if 0 < p < s]
                assert row[i] == pytest.approx(quad(below, 0, s, points=near or None)[0], rel=1e-9, abs=1e-13)


@pytest.mark.parametrize("order", range(6))
def test_derivatives_agree_with_finite_differences(order: int) -> None:
    basis = make_basis(20)
    s, h = np.linspace(0.1, 0.9, 37), 1e-5
    slope = (basis.rows(s + h, order) - basis.rows(s - h, order)) / (2 * h)
    exact = basis.rows(s, order + 1)
    assert np.abs(slope - exact).max() < 1e-5 * np.abs(exact).max()


def test_gram_agrees_with_quadrature_and_is_well_conditioned() -> None:
    basis = make_basis(50)
    s = np.linspace(0, 1, 20001)
    psi = basis.rows(s, 0)
    products = psi[:, :, None] * psi[:, None, :5]
    assert np.abs(simpson(products, x=s, axis=0) - basis.gram()[:, :5]).max() < 1e-12
    assert np.linalg.cond(basis.gram()) == pytest.approx(62, abs=1)


@pytest.mark.parametrize("order", range(8))
def test_peak_is_the_largest_value_anywhere(order: int) -> None:
    basis = make_basis(20)
    sampled = np.abs(basis.rows(np.linspace(0, 1, 50001), order)).max()
    assert sampled <= basis.peak(order) * (1 + 1e-12)
    assert sampled > 0.9999 * basis.peak(order)


def test_spread_bounds_every_function_on_every_interval() -> None:
    grid = make_grid(12)
    fine = np.linspace(0, 1, 10 * (len(grid.s) - 1) + 1)
    for k, order in enumerate(range(2, 6)):
        inside = np.abs(grid.basis.rows(fine[:-1], order)).reshape(len(grid.s) - 1, 10, 12).max(axis=1)
        assert np.all(inside <= grid.spread[k] * (1 + 1e-12))


def test_whitened_weights_measure_the_cost() -> None:
    grid = make_grid(30)
    w = np.random.default_rng(1).normal(size=30)
    gram = grid.basis.gram()
    x = np.concatenate([np.linalg.cholesky(gram).T @ w, [0.3, -2.0]])
    assert grid.weights(x[None])[0] == pytest.approx(w, abs=1e-11)
    assert x[:30] @ x[:30] == pytest.approx(w @ gram @ w)
    assert grid.whiten((gram @ w)[None])[0] == pytest.approx(x[:30])


@pytest.mark.parametrize("count", [10, 25, 50, 200])
@pytest.mark.parametrize("intervals", [500, 1000, 4000])
def test_curves_of_nearby_functions_are_those_of_all(count: int, intervals: int) -> None:
    grid = make_grid(count, intervals)
    x = np.random.default_rng(1).normal(size=(2, count + 2))
    curves, w = grid.curves(x), grid.weights(x)
    for k in range(6):
        start = (x[:, -2:-1] + x[:, -1:] * grid.s, x[:, -1:], 0, 0, 0, 0)[k]
        expected = w @ grid.basis.rows(grid.s, k - 2).T + start
        assert np.abs(curves[:, k] - expected).max() < 1e-14 * np.abs(expected).max()
        if k < 4:
            rows = grid.limited[k * len(grid.s) : (k + 1) * len(grid.s)]
            assert np.abs(x @ rows.T - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("intervals", [500, 1000])
def test_rows_on_and_off_the_grid_agree(intervals: int) -> None:
    grid = make_grid(30, intervals)
    x = np.random.default_rng(2).normal(size=32)
    for quantity in range(3):
        on, near = grid.row_at(quantity, 0.25), grid.row_at(quantity, 0.25 + 1e-9)
        assert on @ x == pytest.approx(grid.curves(x[None])[0, quantity, intervals // 4])
        assert near @ x == pytest.approx(on @ x, abs=1e-5)
