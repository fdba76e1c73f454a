"""Warnings about recordings."""

import re

import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.primitive import learn
from robot.recordings.inspection import warnings_of
from tests.unit.motion.recordings import handwriting, minimum_jerk

TIMES = np.linspace(0, 2, 401)
REACH = np.stack(
    [0.8 * minimum_jerk(TIMES / 2) + 0.1, 1.5 - 0.7 * minimum_jerk(TIMES / 2), 3.3 + 0.2 * np.sin(np.pi * TIMES) ** 3],
    axis=1,
)
LIMITS = Limits(np.array([[-2.0, 2.0], [-2.5, 2.5], [2.5, 4.0]]), np.full(3, 3.0), np.full(3, 50.0), np.full(3, 5000.0))
NAMES = ("shoulder", "elbow", "wrist")


def warnings(times: np.ndarray, positions: np.ndarray, limits: Limits = LIMITS) -> list[str]:
    """Return the warnings about positions (n, 3), rad, at times (n,), s."""
    demonstration = Demonstration(times, positions)
    return warnings_of(demonstration, learn(demonstration), limits, NAMES)


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3, 1e-2])
def test_a_clean_recording_has_no_warnings(noise: float) -> None:
    assert warnings(TIMES, REACH + noise * np.random.default_rng(0).standard_normal(REACH.shape)) == []


def test_samples_that_are_mostly_noise_are_warned_of() -> None:
    """The spline follows their mean, so that the distance of the samples alone says nothing."""
    noisy = REACH + [0.0, 0.0, 0.3] * np.random.default_rng(0).standard_normal(REACH.shape)
    assert any(said.startswith("wrist has noise of 0.") for said in warnings(TIMES, noisy))


def test_a_start_or_end_in_motion_is_warned_of() -> None:
    (begins,) = warnings(TIMES[100:], REACH[100:])
    assert begins.startswith("the demonstration begins moving: shoulder at 0.4")
    (ends,) = warnings(TIMES[:-200], REACH[:-200])
    assert ends.startswith("the demonstration ends moving: shoulder at 0.7")
    assert ends.endswith("rad on the way, or, with a place_time of 0.05 s, only near it")


def test_positions_in_degrees_are_suspected() -> None:
    outside, *_ = warnings(TIMES, np.degrees(REACH))
    assert "outside its range" in outside
    assert outside.endswith("are the positions in degrees?")


def test_a_wrapped_angle_is_suspected() -> None:
    wrapped = REACH.copy()
    wrapped[:, 2] = (REACH[:, 2] + 0.1 + np.pi) % (2 * np.pi) - np.pi
    wrapped[:, 2] -= np.where(np.arange(401) > 200, 2 * np.pi, 0)
    sentences = warnings(TIMES, wrapped)
    assert any("wrist jumps by -6.28 rad from sample 200 to 201; is the angle wrapped" in s for s in sentences)
    assert any(s.startswith("wrist moves at") for s in sentences)


def test_joints_in_another_order_are_suspected() -> None:
    outside, *_ = warnings(TIMES, REACH[:, [2, 1, 0]])
    assert "are the joints in another order? The arm's is shoulder, elbow, wrist" in outside


def test_a_position_outside_its_range_is_reported_without_a_suspected_cause() -> None:
    (outside,) = warnings(TIMES, REACH + np.array([2.5, 0, 0]))
    assert outside == "shoulder reaches 3.4 rad, outside its range of -2 to 2 rad"


def test_times_in_another_unit_are_suspected() -> None:
    (fast,) = warnings(TIMES / 100, REACH)
    assert fast.endswith("times its limit; check the units of positions and times")


def test_limits_exceeded_at_the_demonstrated_duration_are_warned_of_with_one_that_works() -> None:
    """At the duration named there is no warning, at 0.99 of it there is."""
    accelerations = np.array([50.0, 50.0, 1.0])
    limits = Limits(LIMITS.positions, LIMITS.velocities, accelerations, LIMITS.jerks)
    (sentence,) = warnings(TIMES, REACH, limits)
    assert sentence.startswith(
        "in 2 s the movement passes limits of the arm (wrist reaches 5.92 times its acceleration"
    )
    longer = float(re.search(r"duration of ([\d.]+) s or more", sentence)[1])  # type: ignore[index]
    assert longer == pytest.approx(2 * np.sqrt(0.2 * 3 * np.pi**2), rel=0.01)
    assert warnings(longer / 2 * TIMES, REACH, limits) == []
    assert warnings(0.99 * longer / 2 * TIMES, REACH, limits) != []


def test_single_precision_data_read_as_double_is_suspected() -> None:
    data = np.frombuffer(REACH.astype(np.float32)[:-1].tobytes()).reshape(-1, 3)
    sentences = warnings(TIMES[: len(data)], data)
    assert any("read as float32" in sentence for sentence in sentences)


def test_a_matrix_in_column_order_is_suspected() -> None:
    data = np.frombuffer(REACH.tobytes(order="F")).reshape(-1, 3)
    sentences = warnings(TIMES, data)
    assert any("read column by column" in sentence for sentence in sentences)


def test_gaps_are_reported_with_time_and_length() -> None:
    there = (TIMES < 0.5) | (TIMES > 0.8)
    (gap,) = warnings(TIMES[there], REACH[there])
    assert gap == "samples are missing and the spline fills the gaps: 0.31 s after 0.495 s"
    for begin in (0.1, 0.3, 1.2, 1.5):
        there &= (begin > TIMES) | (begin + 0.07 < TIMES)
    (gap,) = warnings(TIMES[there], REACH[there])
    assert gap.count(" after ") == 3
    assert gap.endswith(" and 2 more")


def test_a_joint_that_the_spline_cannot_fit_is_reported() -> None:
    """A minute of handwriting at 8 Hz needs more than 400 functions."""
    times = np.linspace(0, 60, 6001)
    (sentence,) = warnings(times, handwriting(2 * times)[:, None] * minimum_jerk(times)[:, None])
    assert sentence.startswith("joint 0 cannot be followed: the spline passes 0.")


def test_a_recording_with_another_joint_count_is_not_compared_with_the_limits() -> None:
    assert warnings(TIMES, 100 + REACH[:, :2]) == []
