"""The conditions that samples must satisfy before they can move the arm."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from motion.braking import stop
from motion.limits import RETURN_FROM
from protocol import messages as m
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from robot.description import load_robot
from services.controller.checks import check_continuity, check_trajectory

ROBOT = load_robot()
JOINTS = ROBOT.joint_count
Arrays = dict[str, np.ndarray]


def arrays() -> Arrays:
    """Return a stop from 1 rad/s on the first joint."""
    velocities = np.zeros(JOINTS)
    velocities[0] = 1.0
    halt = stop(ROBOT.home, velocities, np.zeros(JOINTS), ROBOT.limits)
    samples = halt.sample(np.arange(int(halt.duration * 1000) + 2) / 1000)
    return {name: getattr(samples, name).copy() for name in ("positions", "velocities", "accelerations")}


def message(values: Arrays, **fields: object) -> m.Trajectory:
    """Return `values` as a trajectory with some fields changed."""
    body: dict[str, object] = {
        "goal_id": "goal", "epoch": 0, "joint_names": list(ROBOT.joint_names), "start_time": 0.1, "dt": 0.001,
        "count": len(values["positions"]), "hit_index": 0, **{n: matrix_bytes(v) for n, v in values.items()},
    }  # fmt: skip
    return m.Trajectory(**{**body, **fields})  # type: ignore[arg-type]


def refusal(values: Arrays, **fields: object) -> Refusal:
    """Check a trajectory that must be refused, and return the refusal."""
    with pytest.raises(Refusal) as caught:
        check_trajectory(message(values, **fields), ROBOT)
    return caught.value


def test_a_good_trajectory_passes():
    """The result is a segment from its tick on."""
    values = arrays()
    segment = check_trajectory(message(values), ROBOT).segment
    assert segment.start == 100
    assert np.array_equal(segment.samples.positions, values["positions"])


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("joint_names", ["a"] * JOINTS),
        ("joint_names", []),
        ("dt", 0.002),
        ("dt", 0.0),
        ("count", 0),
        ("count", 60_002),
        ("hit_index", -1),
        ("hit_index", 1000),
        ("start_time", -0.001),
        ("start_time", 1e300),
        ("goal_id", ""),
        ("goal_id", "x" * 129),
        ("goal_id", "a\nb"),
        ("client_id", "\x1b[2J"),
        ("client_id", "x" * 129),
        ("positions", b"short"),
        ("accelerations", b""),
    ],
)
def test_a_frame_that_does_not_fit(field: str, value: object):
    """Wrong joints, time step, count or hit index are refused; the refusal names the field."""
    refused = refusal(arrays(), **{field: value})
    assert (refused.code, refused.detail["field"]) == ("bad_message", field)
    assert field in refused.message


@pytest.mark.parametrize("name", ["positions", "velocities", "accelerations"])
def test_numbers_that_are_not_finite(name: str):
    """The refusal names their row."""
    values = arrays()
    values[name][3, 2] = np.nan
    refused = refusal(values)
    assert (refused.code, refused.detail["field"]) == ("bad_message", name)
    assert "[3][2]" in refused.message


def _shift_position(values: Arrays) -> None:
    values["positions"][:, 0] += ROBOT.limits.positions[0, 1] - values["positions"][0, 0] + RETURN_FROM + 0.001


def _raise_velocity(values: Arrays) -> None:
    values["velocities"][2, 0] = 15.1


def _raise_acceleration(values: Arrays) -> None:
    values["accelerations"][2, 0] = -300.1


def _raise_jerk(values: Arrays) -> None:
    values["accelerations"][2, 0] += 16.0


@pytest.mark.parametrize(
    ("quantity", "spoil"),
    [
        ("position", _shift_position),
        ("velocity", _raise_velocity),
        ("acceleration", _raise_acceleration),
        ("jerk", _raise_jerk),
    ],
)
def test_a_sample_outside_the_limits(quantity: str, spoil: Callable[[Arrays], None]):
    """The refusal names joint, quantity, value and bound."""
    values = arrays()
    spoil(values)
    refused = refusal(values)
    assert (refused.code, refused.detail["joint"], refused.detail["quantity"]) == ("limit", "joint_1", quantity)
    assert abs(refused.detail["value"]) > abs(refused.detail["bound"])


def returning(outside: float, ticks: int) -> Arrays:
    """Return a thousand ticks that start at rest `outside` rad beyond a limit and are back inside after `ticks`."""
    s, seconds = np.minimum(np.arange(1000) / ticks, 1.0), ticks / 1000
    way = -outside - 0.01
    move = {
        "positions": outside + way * s**3 * (10 - 15 * s + 6 * s**2),
        "velocities": way / seconds * 30 * s**2 * (1 - s) ** 2,
        "accelerations": way / seconds**2 * 60 * s * (1 - s) * (1 - 2 * s),
    }
    values = {name: np.zeros((1000, JOINTS)) for name in move}
    values["positions"][:] = ROBOT.home
    values["positions"][:, 0] = ROBOT.limits.positions[0, 1]
    for name, along in move.items():
        values[name][:, 0] += along
    return values


def test_a_pushed_arm_may_be_led_back():
    """A start up to 0.02 rad outside is accepted if the motion is inside after a fifth of its duration."""
    check_trajectory(message(returning(0.99 * RETURN_FROM, 150), hit_index=999), ROBOT)
    too_far = refusal(returning(1.01 * RETURN_FROM, 150), hit_index=999)
    assert (too_far.code, too_far.detail["bound"]) == ("limit", ROBOT.limits.positions[0, 1])
    assert refusal(returning(0.99 * RETURN_FROM, 800), hit_index=999).code == "limit"


def test_a_jump_is_one_without_a_limit_on_jerk_too():
    """Without a jerk limit, the other limits bound the difference between two samples."""
    free = replace(ROBOT, limits=replace(ROBOT.limits, jerks=np.full(JOINTS, np.inf)))
    values = arrays()
    check_trajectory(message(values), free)
    values["positions"][5:, 3] += 1e-2
    with pytest.raises(Refusal, match="positions of joint_4 jump"):
        check_trajectory(message(values), free)


def test_a_jump_is_refused():
    """Positions must be the integral of velocities, and velocities that of accelerations."""
    values = arrays()
    values["positions"][5:, 3] += 1e-4
    refused = refusal(values)
    assert (refused.code, refused.detail["field"]) == ("bad_message", "positions")
    assert "joint_4" in refused.message
    values = arrays()
    velocities = values["velocities"][:, 1]
    velocities[5:-1] += 0.05
    values["positions"][1:, 1] = ROBOT.home[1] + np.cumsum(velocities[1:] + velocities[:-1]) * 0.001 / 2
    refused = refusal(values)
    assert (refused.code, refused.detail["field"]) == ("bad_message", "velocities")
    assert "joint_2" in refused.message


def test_the_end_is_at_rest():
    """The last sample has no velocity and no acceleration; the refusal names the joint and its value."""
    values = {name: array[:-2] for name, array in arrays().items()}
    refused = refusal(values)
    assert (refused.code, refused.detail["field"]) == ("bad_message", "velocities")
    assert "the motion must end at rest" in refused.message
    assert "joint_1" in refused.message


def test_rounding_at_the_end_is_removed():
    """An end at rest within rounding is taken, and held exactly at rest."""
    values = arrays()
    values["velocities"][-1, 2], values["accelerations"][-1, 3] = 1e-12, -1e-9
    samples = check_trajectory(message(values), ROBOT).segment.samples
    assert not samples.velocities[-1].any()
    assert not samples.accelerations[-1].any()
    assert np.array_equal(samples.velocities[:-1], values["velocities"][:-1])


@pytest.mark.parametrize(("field", "gap"), [("positions", 2e-6), ("velocities", 2e-4), ("accelerations", 2e-2)])
def test_the_start_continues_the_reference(field: str, gap: float):
    """The start must equal the reference within rounding; the refusal names what would jump."""
    values = arrays()
    segment = check_trajectory(message(values), ROBOT).segment
    reference = {name: array[0].copy() for name, array in values.items()}
    check_continuity(tuple(reference.values()), segment, ROBOT)
    reference[field][4] += gap
    with pytest.raises(Refusal) as caught:
        check_continuity(tuple(reference.values()), segment, ROBOT)
    assert (caught.value.code, caught.value.detail["field"]) == ("invalid_goal", field)
    assert "joint_5" in caught.value.message
