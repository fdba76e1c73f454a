"""Exact bounds of polynomials, compared with their values on a fine grid."""

import numpy as np
import pytest

from motion.bernstein import AT_ONCE, bernstein, derivative, first_outside

FINE = np.linspace(0.0, 1.0, 2001)
FREE = np.array([np.inf])


def values(coefficients: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Evaluate polynomials with coefficients (…, n) at times (k,); return (…, k)."""
    return np.polynomial.polynomial.polyval(times, np.moveaxis(coefficients, -1, 0))


def random(count: int, size: int = 6, seed: int = 1) -> np.ndarray:
    """Return random coefficients (count, size) of polynomials."""
    return np.random.default_rng(seed).normal(size=(count, size))


def outside(curve: np.ndarray, low: float, high: float) -> float | None:
    """Return a value of one polynomial on [0, 1] that is outside its bounds, or None."""
    found = first_outside(bernstein(curve[None], np.zeros(1), np.ones(1)), np.array([low]), np.array([high]))
    return found and found.value


@pytest.mark.parametrize("size", range(1, 7))
def test_bernstein_coefficients_enclose_the_curve(size: int):
    """On an interval of [0.25, 1.75]; the first and last coefficients are the values at its ends."""
    coefficients, begin, end = random(50, size), np.full(50, 0.25), np.full(50, 1.75)
    form = bernstein(coefficients, begin, end)
    curve = values(coefficients, 0.25 + 1.5 * FINE)
    assert np.all(form.min(axis=1) <= curve.min(axis=1) + 1e-12)
    assert np.all(form.max(axis=1) >= curve.max(axis=1) - 1e-12)
    assert form[:, [0, -1]] == pytest.approx(curve[:, [0, -1]], abs=1e-12)


def test_on_an_interval_of_zero_length_all_coefficients_are_the_value_there():
    form = bernstein(random(3), np.full(3, 0.5), np.full(3, 0.5))
    assert form == pytest.approx(np.repeat(values(random(3), np.array([0.5])), 6, axis=1))


def test_derivative_has_the_derivatives_coefficients():
    assert derivative(np.array([7.0, 1.0, 2.0, 3.0])).tolist() == [1.0, 4.0, 9.0]


def test_bounds_just_outside_the_extremes_hold_and_just_inside_are_violated():
    """1e-5 outside and 1e-7 inside; the value returned is outside the bound."""
    for curve in random(300):
        low, high = values(curve, FINE).min(), values(curve, FINE).max()
        assert outside(curve, low - 1e-5, high + 1e-5) is None
        beyond = outside(curve, -np.inf, high - 1e-7)
        assert beyond is not None and beyond > high - 1e-7
        beyond = outside(curve, low + 1e-7, np.inf)
        assert beyond is not None and beyond < low + 1e-7


def test_a_curve_that_touches_its_bound_is_inside():
    """Control points of any subdivision lie outside such a bound, so the hull alone cannot decide."""
    for touch in (1 / 3, 0.5, 0.7):
        assert outside(np.array([touch**2, -2 * touch, 1.0]), -1e-15, 9.0) is None
        assert outside(np.array([touch**2 - 1e-12, -2 * touch, 1.0]), 0.0, 9.0) is not None


def test_first_outside_names_curve_and_time():
    curves = np.zeros((3 * AT_ONCE, 6))
    curves[2 * AT_ONCE + 5] = bernstein(np.array([0.0, 0.0, 1.0, 0.0, 0.0, -1.0]), np.zeros(()), np.ones(()))
    found = first_outside(curves, np.full(len(curves), -1.0), np.full(len(curves), 0.3))
    assert found is not None
    assert found.curve == 2 * AT_ONCE + 5
    assert found.value == pytest.approx(found.at**2 - found.at**5)
    assert found.value > 0.3


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_a_coefficient_that_is_not_finite_is_outside(number: float):
    """Even if both bounds are infinite."""
    curves = np.zeros((2, 6))
    curves[1, -1] = number
    assert first_outside(curves, -np.repeat(FREE, 2), np.repeat(FREE, 2)) is not None
