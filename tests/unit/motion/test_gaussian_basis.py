"""Closed forms of the Gaussian basis compared with quadrature and finite differences."""

import numpy as np
import pytest
from scipy.integrate import quad, simpson

from motion.gaussian_basis import make_basis


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


def test_the_derivative_agrees_with_finite_differences() -> None:
    basis = make_basis(20)
    s, h = np.linspace(0.1, 0.9, 37), 1e-5
    slope = (basis.rows(s + h, 0) - basis.rows(s - h, 0)) / (2 * h)
    exact = basis.rows(s, 1)
    assert np.abs(slope - exact).max() < 1e-5 * np.abs(exact).max()


def test_gram_agrees_with_quadrature_and_is_well_conditioned() -> None:
    basis = make_basis(50)
    s = np.linspace(0, 1, 20001)
    psi = basis.rows(s, 0)
    products = psi[:, :, None] * psi[:, None, :5]
    assert np.abs(simpson(products, x=s, axis=0) - basis.gram()[:, :5]).max() < 1e-12
    assert np.linalg.cond(basis.gram()) == pytest.approx(62, abs=1)
