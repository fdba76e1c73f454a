import pickle

import numpy as np
import pytest

from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded, MotionError, SolverFailed
from motion.limits import Limits
from motion.request import Waypoint
from tests.unit.motion.asking import Ask


def waypoint(time: float, position: float = 0.0, velocity: float = np.nan) -> Waypoint:
    return Waypoint(time, np.array([position]), np.array([velocity]))


@pytest.mark.parametrize(
    ("more", "field"),
    [
        ({"duration": 0.0}, "duration"),
        ({"duration": np.nan}, "duration"),
        ({"start": (np.nan, 0.0)}, "start.positions"),
        ({"goal": (0.0, np.inf)}, "goal.velocities"),
        ({"goal": (0.0, 1.0, np.inf)}, "goal.accelerations"),
        ({"rest_fraction": 1.0}, "rest_fraction"),
        ({"rest_fraction": -0.1}, "rest_fraction"),
        ({"rest_fraction": np.nan}, "rest_fraction"),
        ({"rest_fraction": 0.1, "goal": (1.0, 3.0, 5.0)}, "goal.accelerations"),
        ({"tail": "halt"}, "tail"),
        ({"follow_through": -0.01}, "follow_through"),
        ({"follow_through": np.nan}, "follow_through"),
        ({"follow_through": np.inf}, "follow_through"),
        ({"follow_through": 0.1, "goal": (1.0, 3.0, 5.0)}, "goal.accelerations"),
        ({"place_time": 0.0}, "place_time"),
        ({"place_time": 0.049}, "place_time"),
        ({"place_time": np.nan}, "place_time"),
        ({"place_time": np.inf}, "place_time"),
        ({"phase": -0.1}, "phase"),
        ({"phase": 1.0}, "phase"),
        ({"phase": np.nan}, "phase"),
        ({"waypoints": (waypoint(0.005),)}, "waypoints[0].time_from_start"),
        ({"waypoints": (waypoint(0.995),)}, "waypoints[0].time_from_start"),
        ({"waypoints": (waypoint(0.5), waypoint(0.505))}, "waypoints[0].time_from_start"),
        ({"waypoints": (waypoint(0.5), waypoint(1.5))}, "waypoints[1].time_from_start"),
        ({"waypoints": (waypoint(0.85),), "rest_fraction": 0.2}, "waypoints[0].time_from_start"),
        ({"waypoints": (waypoint(np.nan),)}, "waypoints[0].time_from_start"),
        ({"waypoints": (waypoint(0.5, np.inf),)}, "waypoints[0].positions"),
        ({"waypoints": (Waypoint(0.5, np.zeros(2), np.zeros(1)),)}, "waypoints[0].positions"),
    ],
)
def test_a_malformed_request_is_refused_with_its_field(ask: Ask, more: dict[str, object], field: str) -> None:
    with pytest.raises(InvalidMotion) as refusal:
        ask(**more)
    assert refusal.value.field == field
    assert str(refusal.value).startswith(field)


def test_the_final_acceleration_is_free_only_with_a_final_velocity(ask: Ask) -> None:
    assert np.isnan(ask(goal=(1.0, 3.0)).final_accelerations[0])
    assert ask(goal=(1.0, 0.0)).final_accelerations[0] == 0
    assert ask(goal=(1.0, 3.0, 7.0)).final_accelerations[0] == 7
    assert ask(goal=(1.0, 3.0), rest_fraction=0.1).final_accelerations[0] == 0


def test_the_final_acceleration_is_zero_before_a_follow_through(ask: Ask) -> None:
    assert ask(goal=(1.0, 3.0), follow_through=0.1).final_accelerations[0] == 0
    assert ask(goal=(1.0, 3.0, 0.0), follow_through=0.1, rest_fraction=0.1).final_accelerations[0] == 0


def test_durations_and_phases_of_the_parts(ask: Ask) -> None:
    request = ask(duration=2.0, rest_fraction=0.25, follow_through=0.1, phase=0.5)
    assert request.moving_duration == 1.5
    assert request.straight_duration == pytest.approx(0.6)
    assert request.imitates == pytest.approx((0.5, 0.875))


def test_values_beyond_a_limit_by_rounding_are_moved_onto_it(ask: Ask) -> None:
    """Rounding as of float32; values farther beyond stay as they are and are refused later."""
    limits = Limits(np.array([[-1.0, 1.0]]), np.array([3.0]), np.array([np.inf]), np.array([np.inf]))
    beyond = ask(goal=(1.0 + 1.9e-6, -3.0 - 5.9e-6), limits=limits, waypoints=(waypoint(0.5, -1.0 - 1e-7, np.nan),))
    clipped = beyond.clipped()
    assert (clipped.goal.positions[0], clipped.goal.velocities[0]) == (1.0, -3.0)
    assert clipped.waypoints[0].positions[0] == -1.0
    assert np.isnan(clipped.waypoints[0].velocities[0])
    assert clipped.waypoints[0].time_from_start == 0.5
    farther = ask(goal=(1.0 + 2.1e-6, -3.0 - 6.1e-6), limits=limits)
    assert np.array_equal(farther.clipped().goal.positions, farther.goal.positions)
    assert np.array_equal(farther.clipped().goal.velocities, farther.goal.velocities)
    far = np.float32(0.1 + 1e-9)
    assert ask(goal=(float(far), 0.0), limits=Limits.unlimited(1)).clipped().goal.positions[0] == far


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (LimitExceeded(2, "velocity", 9.5, 8.0), ["joint 2", "velocity", "9.5 rad/s lies", "at most 8 rad/s"]),
        (LimitExceeded(0, "position", -3.0, -2.0), ["joint 0", "position", "-3 rad lies", "at least -2 rad"]),
        (
            Infeasible(1, "jerk", 0.25, (-9.0, 9.0), 1.234, [0.5]),
            ["joint 1", "jerk limit of 9 rad/s³", "0.250 s", "1.234 s works", "0.5 s"],
        ),
        (Infeasible(1, "jerk", 0.25, (-9.0, 9.0)), ["joint 1", "allow more time"]),
        (CannotStop(3, -4.5), ["joint 3", "-4.5 rad/s", "rest"]),
        (SolverFailed(4, "PIQP_NUMERICS"), ["joint 4", "PIQP_NUMERICS"]),
    ],
)
def test_error_sentences(error: MotionError, words: list[str]) -> None:
    """They are the same after the error was sent to another process."""
    for each in (error, pickle.loads(pickle.dumps(error))):
        for word in words:
            assert word in str(each)
