import numpy as np
import pytest

from motion.errors import InvalidMotion
from motion.limits import Limits


def test_tightened_takes_the_tighter_everywhere() -> None:
    one = Limits(np.array([[-1.0, 5.0]]), np.array([3.0]), np.array([np.inf]), np.array([9.0]))
    two = Limits(np.array([[-2.0, 4.0]]), np.array([7.0]), np.array([2.0]), np.array([np.inf]))
    for both in (one.tightened(two), two.tightened(one)):
        assert both.ranges[0].tolist() == [[-1, 4], [-3, 3], [-2, 2], [-9, 9]]


def test_ranges_that_do_not_meet_are_refused() -> None:
    one, two = Limits.unlimited(1), Limits.unlimited(1)
    low = Limits(np.array([[-2.0, -1.0]]), two.velocities, two.accelerations, two.jerks)
    high = Limits(np.array([[1.0, 2.0]]), one.velocities, one.accelerations, one.jerks)
    with pytest.raises(InvalidMotion, match=r"limits\.positions"):
        low.tightened(high)


@pytest.mark.parametrize("name", ["velocities", "accelerations", "jerks"])
@pytest.mark.parametrize("bad", [[0.0], [-1.0], [np.nan], [1.0, 2.0]])
def test_bad_limits_are_refused_by_name(name: str, bad: list[float]) -> None:
    good = {"velocities": [1.0], "accelerations": [1.0], "jerks": [1.0]}
    if name == "velocities" and len(bad) == 2:
        name = "positions"  # the other fields' lengths follow from this one
    with pytest.raises(InvalidMotion, match=rf"limits\.{name}"):
        Limits(**{"positions": [[-1.0, 1.0]], **good, name if name != "positions" else "velocities": bad})  # type: ignore[arg-type]
