"""Validation of demonstrations."""

import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.errors import InvalidMotion

TIMES = np.linspace(0, 1, 101)
POSITIONS = np.sin(TIMES)


@pytest.mark.parametrize(
    ("times", "positions", "field"),
    [
        (TIMES, POSITIONS, "positions"),
        (TIMES[:5], POSITIONS[:5, None], "positions"),
        (TIMES[:-1], POSITIONS[:, None], "times"),
        (TIMES[::-1], POSITIONS[:, None], "times"),
        (np.where(TIMES == 0.5, np.nan, TIMES), POSITIONS[:, None], "times"),
        (TIMES, np.where(TIMES == 0.5, np.inf, POSITIONS)[:, None], "positions"),
        (TIMES, POSITIONS[:, None][:, :0], "positions"),
    ],
)
def test_a_malformed_demonstration_is_refused_with_its_field(
    times: np.ndarray, positions: np.ndarray, field: str
) -> None:
    with pytest.raises(InvalidMotion) as refusal:
        Demonstration(times, positions)
    assert refusal.value.field == field
    assert isinstance(refusal.value, ValueError)


@pytest.mark.parametrize(
    ("stamp", "sentence"),
    [
        (0.05, "times: sample 7's time 0.05 s lies before sample 6's"),
        (TIMES[6], "times: sample 7's time 0.06 s is the same as sample 6's"),
        (np.inf, "times: sample 7's time is inf; it must be finite"),
    ],
)
def test_the_message_names_the_sample(stamp: float, sentence: str) -> None:
    times = TIMES.copy()
    times[7] = stamp
    with pytest.raises(InvalidMotion) as refusal:
        Demonstration(times, POSITIONS[:, None])
    assert str(refusal.value) == sentence


def test_phases_run_from_0_to_1_for_any_first_time_stamp() -> None:
    demonstration = Demonstration(1.7e9 + 0.3 * TIMES, POSITIONS[:, None])
    assert demonstration.duration == pytest.approx(0.3, abs=1e-6)
    assert (demonstration.phases[0], demonstration.phases[-1]) == (0.0, 1.0)
    assert np.allclose(demonstration.phases, TIMES, atol=1e-5)
