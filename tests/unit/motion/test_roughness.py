"""Closed forms of smoothing compared with dense least squares."""

import numpy as np
import pytest

from motion import splines
from motion.roughness import Smoother, condense
from tests.unit.motion.recordings import strike

S = np.sort(np.random.default_rng(0).uniform(0, 1, 300))
POSITIONS = np.stack([strike(S), S**2], axis=1) + 1e-2 * np.random.default_rng(1).standard_normal((300, 2))


@pytest.mark.parametrize("gap", [(0.0, 0.0), (0.3, 0.5)])
@pytest.mark.parametrize("count", [22, 30, 52, 90, 150])
def test_condensed_rows_have_the_same_sum_of_squares(count: int, gap: tuple[float, float]) -> None:
    """For any control points, with samples on knots and with knot intervals without samples."""
    s = np.unique(np.concatenate([S, np.linspace(0, 1, 101), [1.0]]))
    s = s[(s <= gap[0]) | (s >= gap[1])]
    positions = np.stack([np.sin(9 * s), s**3], axis=1)
    rows, design = condense(s, positions, count), splines.rows(count, 5, s)
    assert rows.matrix.shape == (count, count)
    for seed in range(3):
        points = np.random.default_rng(seed).standard_normal((count, 2))
        squares = ((rows.matrix @ points - rows.values) ** 2).sum(axis=0) + rows.residual
        assert np.allclose(squares, ((design @ points - positions) ** 2).sum(axis=0))


@pytest.mark.parametrize("order", [2, 3, 4, 5, 6])
def test_the_fit_solves_the_penalised_least_squares(order: int) -> None:
    """Compared with a dense solution that has the penalty's matrix."""
    count, weight = 40, 10.0 ** (2 - 3 * order)
    design = splines.rows(count, 5, S)
    derivative = np.eye(count)
    for step in range(min(order, 5)):
        derivative = splines.differentiation(count - step, 5 - step) @ derivative
    if order == 6:
        jumps = np.diff(derivative, axis=0)
        penalty = jumps.T @ jumps * (count - 5)
    else:
        penalty = derivative.T @ splines.gram(count - order, 5 - order) @ derivative
    wanted = np.linalg.solve(design.T @ design + weight * penalty, design.T @ POSITIONS)
    smoother = Smoother(condense(S, POSITIONS, count), order)
    for joint in range(2):
        found = smoother.control_points(joint, weight)
        assert np.allclose(design @ found, design @ wanted[:, joint], atol=1e-6)


@pytest.mark.parametrize("order", [2, 4, 6])
def test_the_largest_weight_leaves_a_polynomial(order: int) -> None:
    smoother = Smoother(condense(S, POSITIONS, 40), order)
    wanted = np.polyval(np.polyfit(S, POSITIONS[:, 0], order - 1), S)
    found = splines.rows(40, 5, S) @ smoother.control_points(0, 1e6 * smoother.singular[0] ** 2)
    assert np.allclose(found, wanted, atol=1e-6)


def test_the_standard_error_agrees_with_the_dense_problem() -> None:
    """The square root of the mean variance of d″ under the posterior covariance of the control points."""
    count, weight = 30, 1e-5
    second = splines.differentiation(count - 1, 4) @ splines.differentiation(count, 5)
    penalty = second.T @ splines.gram(count - 2, 3) @ second
    design = splines.rows(count, 5, S)
    covariance = np.linalg.inv(design.T @ design + weight * penalty)
    wanted = np.sqrt(np.trace(second @ covariance @ second.T @ splines.gram(count - 2, 3)))
    assert Smoother(condense(S, POSITIONS, count), 2).acceleration_error(weight) == pytest.approx(wanted, rel=1e-6)


def test_repeated_samples_do_not_make_noise_look_like_signal() -> None:
    """Each noisy sample of a line is repeated ten times; with the correlation length known, noise is not fitted."""
    s = np.linspace(0, 1, 1000)
    steps = np.repeat(1e-2 * np.random.default_rng(3).standard_normal(100), 10)
    smoother = Smoother(condense(s, (s + steps)[:, None], 52), 4)
    once, all_of_them = smoother.choose(0, 10.0), smoother.choose(0)
    assert once[0] > 1e3 * all_of_them[0]
    assert np.sqrt(once[1]) == pytest.approx(1e-2, rel=0.2)
