import numpy as np
import pytest

from motion.errors import InvalidMotion
from motion.limits import Limits


def test_tightened_takes_the_tighter_of_each_bound() -> None:
    one = Limits(np.array([[-1.0, 5.0]]), np.array([3.0]), np.array([np.inf]), np.array([9.0]))
    two = Limits(np.array([[-2.0, 4.0]]), np.array([7.0]), np.array([2.0]), np.array([np.inf]))
    for both in (one.tightened(two), two.tightened(one)):
        assert both.ranges[0].tolist() == [[-1, 4], [-3, 3], [-2, 2], [-9, 9]]


def test_tightened_refuses_disjoint_ranges() -> None:
    one, two = Limits.unlimited(1), Limits.unlimited(1)
    low = Limits(np.array([[-2.0, -1.0]]), two.velocities, two.accelerations, two.jerks)
    high = Limits(np.array([[1.0, 2.0]]), one.velocities, one.accelerations, one.jerks)
    with pytest.raises(InvalidMotion, match=r"limits\.positions"):
        low.tightened(high)


@pytest.mark.parametrize("name", ["velocities", "accelerations", "jerks"])
@pytest.mark.parametrize("bad", [[0.0], [-1.0], [np.nan], [1.0, 2.0]])
def test_invalid_limits_are_refused_with_their_field(name: str, bad: list[float]) -> None:
    good = {"velocities": [1.0], "accelerations": [1.0], "jerks": [1.0]}
    if name == "velocities" and len(bad) == 2:
        name = "positions"  # the other fields' lengths follow from this one
    with pytest.raises(InvalidMotion, match=rf"limits\.{name}"):
        Limits(**{"positions": [[-1.0, 1.0]], **good, name if name != "positions" else "velocities": bad})  # type: ignore[arg-type]


def test_outside_marks_values_beyond_their_limits() -> None:
    limits = Limits(np.array([[-1.0, 2.0], [-5.0, 5.0]]), np.array([3.0, 4.0]), np.full(2, np.inf), np.full(2, np.inf))
    both = np.arange(2)
    assert not limits.outside(both, np.array([[2.0, -5.0], [-3.0, 4.0]])).any()
    assert not limits.outside(both, np.full((2, 2), np.nan)).any()
    values = np.array([[[2.0 + 1e-15 * 2, 0], [0, -4.1]], [[-1.1, 0], [0, 0]]])
    assert np.argwhere(limits.outside(both, values)).tolist() == [[0, 0, 0], [0, 1, 1], [1, 0, 0]]


def test_exceeded_reports_the_first_value_beyond_its_limit_and_rounding() -> None:
    limits = Limits(np.array([[-1.0, 2.0], [-5.0, 5.0]]), np.array([3.0, 4.0]), np.full(2, np.inf), np.full(2, np.inf))
    both = np.arange(2)
    assert limits.exceeded(both, np.array([[2.0 + 2.9e-6, 0], [0, -4.0 - 7.9e-6]])) is None
    error = limits.exceeded(both, np.array([[-1.1, 0], [4.0, -4.1]]))
    assert error and (error.joint, error.quantity, error.value, error.bound) == (0, "position", -1.1, -1.0)
    error = limits.exceeded(both, np.array([[-1.1, 0], [3.0, -4.1]]), np.array([[0.2], [0.0]]))
    assert error and (error.joint, error.quantity, error.value, error.bound) == (1, "velocity", -4.1, -4.0)


def test_clipped_moves_values_beyond_their_limit_by_rounding() -> None:
    """Rounding is a millionth of the range; quantities without a limit stay as they are."""
    limits = Limits(np.array([[-1.0, 3.0]] * 5), np.full(5, 2.0), np.full(5, np.inf), np.full(5, 50.0))
    values = np.array([3.0 + 3.9e-6, 3.0 + 4.1e-6, -1.0 - 3.9e-6, 0.3, np.nan])
    expected = [3.0, 3.0 + 4.1e-6, -1.0, 0.3, np.nan]
    assert np.array_equal(limits.clipped(0, values), expected, equal_nan=True)
    speeds = np.array([2.0 + 3.9e-6, -2.0 - 3.9e-6, 2.1, 0.0, np.nan])
    assert np.array_equal(limits.clipped(1, speeds), [2.0, -2.0, 2.1, 0.0, np.nan], equal_nan=True)
    assert np.array_equal(limits.clipped(2, values), values, equal_nan=True)


def test_ranges_are_read_only_and_unlimited_is_infinite() -> None:
    free = Limits.unlimited(3)
    assert free.joint_count == 3
    assert np.isinf(free.ranges).all()
    with pytest.raises(ValueError, match="read-only"):
        free.ranges[0, 0, 0] = 1.0
