"""The conditions that polynomials must satisfy at all times before they can move the arm."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from motion.braking import stop
from motion.limits import RETURN_FROM
from motion.trajectory import Trajectory
from protocol import messages as m
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from robot.description import RobotConfig, load_robot
from services.controller.checks import check_trajectory
from services.controller.timeline import Segment

ROBOT = load_robot()
JOINTS = ROBOT.joint_count
FOREVER = 1e9


def moved(way: float, seconds: float, first: float = 0.0) -> np.ndarray:
    """Return coefficients (6,) of the quintic that goes `way` from rest to rest."""
    ways = way * np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0]) / seconds ** np.arange(6.0)
    ways[0] = first
    return ways


def there_and_back(way: float = 0.3, seconds: float = 0.5, rest: float = 0.0) -> Trajectory:
    """Return a motion: the first joint goes `way` from home and back; then all joints rest for `rest` s."""
    coefficients = np.zeros((3, JOINTS, 6))
    coefficients[:, :, 0] = ROBOT.home
    coefficients[0, 0] = moved(way, seconds, ROBOT.home[0])
    coefficients[1, 0] = moved(-way, seconds, ROBOT.home[0] + way)
    return Trajectory(np.array([0.0, seconds, 2 * seconds, 2 * seconds + rest]), coefficients)


def message(motion: Trajectory, **fields: object) -> m.Trajectory:
    """Return a motion as a request with some fields changed."""
    body: dict[str, Any] = {
        "goal_id": "goal", "epoch": 0, "joint_names": list(ROBOT.joint_names), "start_time": 0.1, "dt": 0.001,
        "count": int(np.ceil(motion.duration * 1000 - 1e-6)) + 1, "hit_index": 0,
        "pieces": m.Pieces(breaks=motion.breaks.tolist(), coefficients=matrix_bytes(motion.coefficients)),
    }  # fmt: skip
    return m.Trajectory(**{**body, **fields})


def checked(motion: Trajectory, config: RobotConfig = ROBOT, **fields: object) -> Segment:
    """Check a motion that must be accepted."""
    return check_trajectory(message(motion, **fields), config).segment


def refusal(motion: Trajectory, config: RobotConfig = ROBOT, **fields: object) -> Refusal:
    """Check a motion that must be refused, and return the refusal."""
    with pytest.raises(Refusal) as caught:
        check_trajectory(message(motion, **fields), config)
    return caught.value


@pytest.mark.parametrize("rest", [0.0, 0.25])
def test_it_is_sampled_at_every_tick(rest: float):
    """The samples equal the polynomials, and the last one is at rest."""
    motion = there_and_back(rest=rest)
    segment = checked(motion)
    assert (segment.start, segment.end) == (100, 1100 + 1000 * rest)
    wanted = motion.sample(np.arange(len(segment.samples)) * ROBOT.tick)
    for name in ("positions", "velocities", "accelerations"):
        assert np.array_equal(getattr(segment.samples, name), getattr(wanted, name))
    assert segment.samples.positions[-1].tolist() == ROBOT.home.tolist()
    assert not segment.samples.velocities[-1].any()
    assert not segment.samples.accelerations[-1].any()


@pytest.mark.parametrize("seconds", [0.5003, 0.5 + 4e-10, 0.5 - 4e-10])
def test_an_end_between_two_ticks(seconds: float):
    """A sample at exact rest follows, also if the end is between two ticks by rounding alone."""
    motion = there_and_back(seconds=seconds)
    segment = checked(motion)
    assert len(segment.samples) == (1002 if seconds == 0.5003 else 1001)
    assert not segment.samples.velocities[-1].any()
    assert not segment.samples.accelerations[-1].any()


def test_a_single_constant_piece_stays():
    """A motion without duration is one sample at the piece's position."""
    motion = Trajectory(np.array([0.0, 0.0]), ROBOT.home[None, :, None] * np.eye(6)[0])
    assert checked(motion).samples.positions.tolist() == [ROBOT.home.tolist()]


@pytest.mark.parametrize(
    ("breaks", "sentence"),
    [
        ([], "has 0 entries"),
        ([0.0], "has 1 entries"),
        ([0.1, 0.5, 1.0, 1.0], "the first piece begins at 0"),
        ([0.0, 0.5, 0.4, 1.0], r"pieces.breaks\[2\] is 0.4 after 0.5 s; breaks must not decrease"),
    ],
)
def test_invalid_breaks_are_refused(breaks: list[float], sentence: str):
    coefficients = matrix_bytes(there_and_back().coefficients)
    with pytest.raises(Refusal, match=sentence) as caught:
        check_trajectory(message(there_and_back(), pieces=m.Pieces(breaks=breaks, coefficients=coefficients)), ROBOT)
    assert (caught.value.code, caught.value.detail["field"]) == ("bad_message", "pieces.breaks")


def test_coefficients_that_do_not_fit():
    """A wrong count or a number that is not finite is refused; the refusal names its place."""
    motion = there_and_back()
    pieces = m.Pieces(breaks=motion.breaks.tolist(), coefficients=bytes(8))
    refused = refusal(motion, pieces=pieces)
    assert (refused.code, refused.detail["field"]) == ("bad_message", "pieces.coefficients")
    motion.coefficients[1, 2, 3] = np.nan
    assert "pieces.coefficients[1][15] is nan" in refusal(motion).message


@pytest.mark.parametrize("count", [0, 1000, 1002, 60_002])
def test_a_count_that_differs_from_the_duration_is_refused(count: int):
    refused = refusal(there_and_back(), count=count)
    assert (refused.code, refused.detail["field"]) == ("bad_message", "count")


def test_a_plan_of_60_s_and_no_longer():
    """A plan of 60 s may have a rest at its end."""
    assert checked(there_and_back(rest=59.0)).end == 60_100
    assert refusal(there_and_back(rest=59.001)).detail["field"] == "count"


def test_either_pieces_or_samples():
    motion = there_and_back()
    both = refusal(motion, positions=b"")
    assert both.message == "give either pieces or positions, velocities, accelerations; positions is there as well"
    neither = refusal(motion, pieces=None)
    assert neither.message == "positions is missing; give positions, velocities, accelerations, or pieces"
    some = refusal(motion, pieces=None, positions=b"", accelerations=b"")
    assert (some.code, some.detail["field"]) == ("bad_message", "velocities")


def _beyond_position(motion: Trajectory) -> None:
    motion.coefficients[:, 0, 0] += (ROBOT.limits.positions[0, 1] - 0.3) - ROBOT.home[0] + 1e-4


def _beyond_velocity(motion: Trajectory) -> None:
    motion.breaks[:] /= 16
    motion.coefficients[:] *= 16.0 ** np.arange(6)


def _beyond_acceleration(motion: Trajectory) -> None:
    motion.breaks[:] *= 0.1
    motion.coefficients[:] *= 10.0 ** np.arange(6)


def _beyond_jerk(motion: Trajectory) -> None:
    motion.breaks[:] *= 0.19
    motion.coefficients[:] *= (1 / 0.19) ** np.arange(6)


@pytest.mark.parametrize(
    ("quantity", "spoil"),
    [
        ("position", _beyond_position),
        ("velocity", _beyond_velocity),
        ("acceleration", _beyond_acceleration),
        ("jerk", _beyond_jerk),
    ],
)
def test_beyond_a_limit(quantity: str, spoil: Callable[[Trajectory], None]):
    """The refusal names joint, quantity, value and bound of the one limit that is exceeded."""
    motion = there_and_back()
    spoil(motion)
    own = ROBOT.limits
    free = {name: np.full(JOINTS, FOREVER) for name in ("velocities", "accelerations", "jerks")}
    name = {"velocity": "velocities"}.get(quantity, f"{quantity}s")
    limits = replace(own, **({**free, name: getattr(own, name)} if name in free else {}))
    refused = refusal(motion, replace(ROBOT, limits=limits))
    assert (refused.code, refused.detail["joint"], refused.detail["quantity"]) == ("limit", "joint_1", quantity)
    assert abs(refused.detail["value"]) > abs(refused.detail["bound"])
    assert " s, beyond its limit of " in refused.message


def test_a_limit_passed_between_two_ticks():
    """It is found although every sample is inside; as samples the motion is accepted."""
    motion = there_and_back(seconds=0.101)
    samples = motion.sample(np.arange(203) * ROBOT.tick)
    fastest = motion.sample(np.array([0.0505])).velocities[0, 0]
    limits = {name: np.full(JOINTS, FOREVER) for name in ("velocities", "accelerations", "jerks")}
    limits["velocities"][0] = (samples.velocities.max() + fastest) / 2
    robot = replace(ROBOT, limits=replace(ROBOT.limits, **limits))
    matrices = {name: matrix_bytes(getattr(samples, name)) for name in ("positions", "velocities", "accelerations")}
    check_trajectory(message(motion, pieces=None, **matrices), robot)
    refused = refusal(motion, robot)
    assert refused.detail["quantity"] == "velocity"
    assert limits["velocities"][0] < refused.detail["value"] <= fastest + 1e-12


def test_a_bound_is_taken_as_it_is():
    """A value on the bound is inside; up to a millionth of the range beyond it counts as rounding."""
    top, low = ROBOT.home[0] + 0.3, ROBOT.limits.positions[0, 0]
    for high, good in ((top, True), (top - 0.9e-6 * (top - low), True), (top - 1.1e-6 * (top - low), False)):
        positions = ROBOT.limits.positions.copy()
        positions[0, 1] = high
        robot = replace(ROBOT, limits=replace(ROBOT.limits, positions=positions))
        if good:
            checked(there_and_back(), robot)
        else:
            refused = refusal(there_and_back(), robot)
            assert refused.detail["quantity"] == "position"
            assert refused.detail["value"] == pytest.approx(top, abs=1e-7)


@pytest.mark.parametrize(("order", "gap"), [(0, 2e-8), (1, 2e-6), (2, 2e-4)])
def test_a_jump_is_refused(order: int, gap: float):
    """Position, velocity and acceleration must be continuous where two pieces meet."""
    motion = there_and_back()
    # (1 − 2t)³ and its first two derivatives are 0 at the end of the piece.
    fades = gap * np.array([1.0, -6.0, 12.0, -8.0])
    motion.coefficients[1, 3, order : order + 4] += fades
    refused = refusal(motion)
    assert (refused.code, refused.detail["field"]) == ("bad_message", "pieces.coefficients")
    name = ("positions", "velocities", "accelerations")[order]
    assert refused.message.startswith(f"{name} of joint_4 jump by ")
    assert "at 0.5 s, from piece 0 to the next" in refused.message


@pytest.mark.parametrize(("order", "quantity"), [(1, "velocities"), (2, "accelerations")])
def test_the_end_is_at_rest(order: int, quantity: str):
    """A motion that still moves or accelerates at its end is refused."""
    motion = there_and_back()
    motion.coefficients[-1, 2, order] = 0.01
    assert re.match(f"{quantity} of joint_3 end at .*; the motion must end at rest", refusal(motion).message)


def test_no_constant_piece_is_needed():
    """A last piece that ends at rest is enough; the reference stays at its end."""
    whole, motion = checked(there_and_back()), there_and_back()
    segment = checked(Trajectory(motion.breaks[:-1], motion.coefficients[:-1]))
    assert (segment.start, segment.end) == (whole.start, whole.end)
    assert np.allclose(segment.samples.positions, whole.samples.positions, rtol=0, atol=1e-12)
    assert not np.any([segment.samples.velocities[-1], segment.samples.accelerations[-1]])


def returning(outside: float, seconds: float) -> Trajectory:
    """The first joint begins at rest `outside` rad beyond its limit, is 0.01 rad inside after `seconds`, and stays."""
    coefficients = np.zeros((2, JOINTS, 6))
    coefficients[:, :, 0] = ROBOT.home
    high = ROBOT.limits.positions[0, 1]
    coefficients[0, 0] = moved(-outside - 0.01, seconds, high + outside)
    coefficients[1, 0, 0] = high - 0.01
    return Trajectory(np.array([0.0, seconds, 1.0]), coefficients)


def test_a_pushed_arm_may_be_led_back():
    """A start up to 0.02 rad outside is accepted if the motion is inside after a fifth of its duration."""
    checked(returning(0.99 * RETURN_FROM, 0.15), hit_index=999)
    assert refusal(returning(1.01 * RETURN_FROM, 0.15), hit_index=999).code == "limit"
    assert refusal(returning(0.99 * RETURN_FROM, 0.8), hit_index=999).code == "limit"


def test_coefficients_whose_values_overflow_are_refused():
    """The coefficients are finite, but the curve is not."""
    free = np.full(JOINTS, np.inf)
    limits = replace(
        ROBOT.limits, positions=np.stack([-free, free], axis=1), velocities=free, accelerations=free, jerks=free
    )
    robot = replace(ROBOT, limits=limits)
    motion = there_and_back(rest=0.1)
    motion.coefficients[0, 0, 5] = 1e308
    assert refusal(motion, robot).code == "bad_message"
    motion = there_and_back(rest=0.1)
    motion.coefficients[0, 0, 3:] = 1e308, -1.7e308, 1e308
    motion.coefficients[1:, 0, 0] = 1e308
    assert refusal(motion, robot).code in ("bad_message", "limit")


def test_stops_are_smooth_within_rounding():
    """Of 200 random states with accelerations up to their limits, in 6 joints that end at different times."""
    random, limits = np.random.default_rng(3), ROBOT.limits
    for _ in range(200):
        velocities = random.uniform(-0.05, 0.05, JOINTS) * limits.velocities
        accelerations = random.uniform(-1.0, 1.0, JOINTS) * limits.accelerations
        motion = stop(ROBOT.home, velocities, accelerations, ROBOT.limits)
        with np.errstate(all="raise"):
            checked(motion)


def test_many_pieces_of_many_joints_are_the_same_motion():
    """Checked and sampled in parts, a spline in 500 pieces gives the same samples as in two."""
    motion = there_and_back()
    cuts = np.linspace(0.0, 1.0, 501)
    owner = np.minimum((cuts[:-1] >= 0.5).astype(int), 1)
    since = cuts[:-1] - motion.breaks[owner]
    coefficients = np.array(motion.coefficients[owner])
    for last in range(5):
        for power in range(4, last - 1, -1):
            coefficients[..., power] += since[:, None] * coefficients[..., power + 1]
    fine = Trajectory(np.append(cuts, 1.0), np.concatenate([coefficients, motion.coefficients[-1:]]))
    one, two = checked(fine).samples, checked(motion).samples
    assert one.positions == pytest.approx(two.positions, abs=1e-12)
    assert one.accelerations == pytest.approx(two.accelerations, abs=1e-9)
