"""Conversions between arrays and messages."""

import numpy as np
import pytest

from motion.limits import Limits
from motion.trajectory import Samples
from protocol import messages as m
from protocol.errors import Refusal
from robot.conversions import finite_or_null, limit_fields, sample_matrices, samples_of

SAMPLES = Samples(*np.arange(18.0).reshape(3, 3, 2))


def trajectory(count: int = 3) -> m.Trajectory:
    return m.Trajectory(
        goal_id="a",
        joint_names=["x", "y"],
        start_time=0.0,
        dt=0.001,
        count=count,
        hit_index=2,
        epoch=0,
        stamps=m.Stamps(),
        **sample_matrices(SAMPLES),
    )


def test_samples_round_trip_exactly():
    back = samples_of(trajectory())
    for name in ("positions", "velocities", "accelerations"):
        np.testing.assert_array_equal(getattr(back, name), getattr(SAMPLES, name))


def test_a_matrix_of_the_wrong_size_is_refused():
    with pytest.raises(Refusal) as caught:
        samples_of(trajectory(count=4))
    assert caught.value.code == "bad_message"
    assert caught.value.detail["field"] == "positions"


def test_infinite_values_become_null():
    assert finite_or_null(np.array([1.0, np.inf])) == [1.0, None]


def test_infinite_limits_become_null_in_messages():
    ranges = np.array([[-1.0, 1.0], [-np.inf, np.inf], [-1.0, np.inf]])
    limits = Limits(ranges, np.array([np.inf, 2.0, 1.0]), np.array([3.0, np.inf, 1.0]), np.full(3, np.inf))
    said = m.PlanLimits(**limit_fields(limits))
    assert said.positions == [(-1.0, 1.0), None, None]
    assert (said.velocities, said.accelerations) == ([None, 2.0, 1.0], [3.0, None, 1.0])
    assert said.jerks == [None, None, None]
