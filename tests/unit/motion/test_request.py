from collections.abc import Callable

import numpy as np
import pytest

from motion.errors import CannotStop, Infeasible, InvalidMotion, LimitExceeded, MotionError, SolverFailed
from motion.request import MotionRequest, Waypoint

Ask = Callable[..., MotionRequest]


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
def test_malformed_requests_name_their_field(ask: Ask, more: dict[str, object], field: str) -> None:
    with pytest.raises(InvalidMotion) as refusal:
        ask(**more)
    assert refusal.value.field == field
    assert str(refusal.value).startswith(field)


def test_final_acceleration_is_free_only_where_the_arm_moves_on(ask: Ask) -> None:
    assert np.isnan(ask(goal=(1.0, 3.0)).final_accelerations[0])
    assert ask(goal=(1.0, 0.0)).final_accelerations[0] == 0
    assert ask(goal=(1.0, 3.0, 7.0)).final_accelerations[0] == 7
    assert ask(goal=(1.0, 3.0), rest_fraction=0.1).final_accelerations[0] == 0


@pytest.mark.parametrize(("fraction", "moving"), [(0.0, 1.0), (0.1, 0.9), (0.0995, 0.9), (0.3, 0.7), (0.99, 0.01)])
def test_rest_fraction_is_rounded_up_to_the_grid(ask: Ask, fraction: float, moving: float) -> None:
    assert ask(rest_fraction=fraction).moving_fraction == moving


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (LimitExceeded(2, "velocity", 9.5, 8.0), ["joint 2", "velocity", "9.5", "at most 8"]),
        (LimitExceeded(0, "position", -3.0, -2.0), ["joint 0", "position", "-3", "at least -2"]),
        (Infeasible(1, "jerk", 0.25, 1.234, [0.5]), ["joint 1", "jerk", "0.250 s", "1.234 s works", "0.5 s"]),
        (Infeasible(1, "jerk", 0.25, None, None), ["joint 1", "no longer duration"]),
        (CannotStop(3, -4.5), ["joint 3", "-4.5", "rest"]),
        (SolverFailed(4, "PIQP_NUMERICS"), ["joint 4", "PIQP_NUMERICS"]),
    ],
)
def test_error_sentences(error: MotionError, words: list[str]) -> None:
    for word in words:
        assert word in str(error)
