"""Exact bounds of polynomials, beside their values on a fine grid."""

import numpy as np
import pytest

from motion.bernstein import AT_ONCE, bernstein, derivative, first_outside

FINE = np.linspace(0.0, 1.0, 2001)
FREE = np.array([np.inf])


def values(coefficients: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Polynomials (…, n) at times (k,): (…, k)."""
    return np.polynomial.polynomial.polyval(times, np.moveaxis(coefficients, -1, 0))


def random(count: int, size: int = 6, seed: int = 1) -> np.ndarray:
    """Coefficients of `count` polynomials."""
    return np.random.default_rng(seed).normal(size=(count, size))


def outside(curve: np.ndarray, low: float, high: float) -> float | None:
    """A value of one polynomial beyond its bounds."""
    found = first_outside(bernstein(curve[None], np.zeros(1), np.ones(1)), np.array([low]), np.array([high]))
    return found and found.value


@pytest.mark.parametrize("size", range(1, 7))
def test_its_coefficients_enclose_the_curve(size: int):
    """On any part of the time; the first and the last are the values at the ends."""
    coefficients, begin, end = random(50, size), np.full(50, 0.25), np.full(50, 1.75)
    form = bernstein(coefficients, begin, end)
    curve = values(coefficients, 0.25 + 1.5 * FINE)
    assert np.all(form.min(axis=1) <= curve.min(axis=1) + 1e-12)
    assert np.all(form.max(axis=1) >= curve.max(axis=1) - 1e-12)
    assert form[:, [0, -1]] == pytest.approx(curve[:, [0, -1]], abs=1e-12)


def test_an_interval_without_length():
    """Is its one point."""
    form = bernstein(random(3), np.full(3, 0.5), np.full(3, 0.5))
    assert form == pytest.approx(np.repeat(values(random(3), np.array([0.5])), 6, axis=1))


def test_the_derivative():
    """Coefficient by coefficient."""
    assert derivative(np.array([7.0, 1.0, 2.0, 3.0])).tolist() == [1.0, 4.0, 9.0]


def test_bounds_are_exact():
    """A bound a little beyond the extremes holds, one a little within does not, and the value found is beyond it."""
    for curve in random(300):
        low, high = values(curve, FINE).min(), values(curve, FINE).max()
        assert outside(curve, low - 1e-5, high + 1e-5) is None
        beyond = outside(curve, -np.inf, high - 1e-7)
        assert beyond is not None and beyond > high - 1e-7
        beyond = outside(curve, low + 1e-7, np.inf)
        assert beyond is not None and beyond < low + 1e-7


def test_a_curve_that_touches_its_bound():
    """Is inside, although no hull of it ever is."""
    for touch in (1 / 3, 0.5, 0.7):
        assert outside(np.array([touch**2, -2 * touch, 1.0]), -1e-15, 9.0) is None
        assert outside(np.array([touch**2 - 1e-12, -2 * touch, 1.0]), 0.0, 9.0) is not None


def test_which_one_and_where():
    """Among many; the place lies in the interval of the one."""
    curves = np.zeros((3 * AT_ONCE, 6))
    curves[2 * AT_ONCE + 5] = bernstein(np.array([0.0, 0.0, 1.0, 0.0, 0.0, -1.0]), np.zeros(()), np.ones(()))
    found = first_outside(curves, np.full(len(curves), -1.0), np.full(len(curves), 0.3))
    assert found is not None
    assert found.curve == 2 * AT_ONCE + 5
    assert found.value == pytest.approx(found.at**2 - found.at**5)
    assert found.value > 0.3


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_outside(number: float):
    """Even where there is no bound."""
    curves = np.zeros((2, 6))
    curves[1, -1] = number
    assert first_outside(curves, -np.repeat(FREE, 2), np.repeat(FREE, 2)) is not None
