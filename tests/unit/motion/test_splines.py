"""B-splines compared with scipy's and with their defining properties."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from motion import splines

CASES = [(5, 3), (20, 3), (50, 5), (52, 5), (51, 4), (49, 2), (400, 3)]
S = np.linspace(0, 1, 4001)


def scipys(points: np.ndarray, degree: int) -> BSpline:
    """Return scipy's spline with control points (n,) or (n, J) on clamped uniform knots."""
    inner = np.linspace(0, 1, len(points) - degree + 1)
    return BSpline(np.r_[np.zeros(degree), inner, np.ones(degree)], points, degree)


def random_points(count: int, joints: int | None = None) -> np.ndarray:
    return np.random.default_rng(count).normal(size=count if joints is None else (count, joints))


@pytest.mark.parametrize(("count", "degree"), CASES)
def test_rows_are_the_basis_functions(count: int, degree: int) -> None:
    rows, points = splines.rows(count, degree, S), random_points(count)
    assert rows.shape == (len(S), count)
    assert np.abs(rows @ points - scipys(points, degree)(S)).max() < 1e-12
    assert np.abs(rows.sum(axis=1) - 1).max() < 1e-13
    assert (rows >= 0).all()


@pytest.mark.parametrize(("count", "degree"), CASES)
def test_integration_and_differentiation(count: int, degree: int) -> None:
    points = random_points(count)
    curve = scipys(points, degree)
    integral = splines.integration(count, degree) @ points
    assert np.abs(scipys(integral, degree + 1)(S) - curve.antiderivative()(S)).max() < 1e-13
    slope = splines.differentiation(count, degree) @ points
    exact = curve.derivative()(S[1:-1])
    assert np.abs(scipys(slope, degree - 1)(S[1:-1]) - exact).max() < 1e-11 * np.abs(exact).max()
    back = splines.differentiation(count + 1, degree + 1) @ integral
    assert back == pytest.approx(points, abs=1e-10)


@pytest.mark.parametrize(("count", "degree"), CASES)
def test_greville_abscissae_are_the_control_points_of_a_line(count: int, degree: int) -> None:
    abscissae = splines.greville(count, degree)
    assert np.abs(splines.rows(count, degree, S) @ abscissae - S).max() < 1e-13
    assert (np.diff(abscissae) > 0).all()


@pytest.mark.parametrize(("count", "degree"), CASES[:6])
@pytest.mark.parametrize("refinement", [1, 2, 3, 16])
def test_insertion_is_exact(count: int, degree: int, refinement: int) -> None:
    """The curve is the same on refined knots, and its control points approach it."""
    inner = np.linspace(0, 1, (count - degree) * refinement + 1)
    inner[::refinement] = splines.knots(count, degree)[degree:-degree]
    finer = np.concatenate([np.zeros(degree), inner, np.ones(degree)])
    matrix = splines.insertion(count, degree, finer)
    points = random_points(count)
    refined = matrix @ points
    curve = scipys(points, degree)
    assert np.abs(BSpline(finer, refined, degree)(S) - curve(S)).max() < 1e-12 * np.abs(points).max()
    assert (matrix.data > -1e-13).all()
    assert matrix.sum(axis=1) == pytest.approx(1, abs=1e-13)
    assert refined.max() <= points.max() + 1e-12
    if refinement == 16:
        assert np.abs(refined - curve(splines.averages(finer, degree))).max() < 0.1 * np.ptp(points)


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
@pytest.mark.parametrize("s", [0.01, 0.31, 0.5, 0.99])
def test_a_knot_of_full_multiplicity_makes_the_curve_pass_through_a_control_point(degree: int, s: float) -> None:
    """A waypoint on its limit needs such a knot."""
    points = random_points(20)
    curve = scipys(points, degree)
    finer = np.sort(np.concatenate([curve.t, np.full(degree, s)]))
    refined = splines.insertion(20, degree, finer) @ points
    assert refined == pytest.approx(curve.insert_knot(s, degree).c[: len(refined)], abs=1e-11)
    assert np.abs(refined - curve(s)).min() < 1e-12


def test_cached_arrays_are_read_only() -> None:
    shared = splines.knots(20, 3), splines.integration(20, 3), splines.differentiation(20, 3), splines.greville(20, 3)
    for array in shared:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
