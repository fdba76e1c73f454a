"""Messages made of a plan: trajectory, reply and publication."""

import numpy as np
import pytest

from deploy.demonstrations.make_forehand import HIT, HIT_VELOCITIES
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import Boundary
from motion.trajectory import Trajectory
from protocol import messages as m
from protocol.codec import decode, encode, matrix
from robot.description import load_robot
from robot.shipped import DEMONSTRATIONS
from services.planner.goals import Origin, motion_request
from services.planner.learning import learn_from_csv
from services.planner.messages import executed_message, goal_reply, plan_message, sampled_message
from services.planner.solving import Made

ROBOT = load_robot()
JOINTS = ROBOT.joint_count
REST = np.zeros(JOINTS)
ORIGIN = Origin(3.5, 7, Boundary(ROBOT.home, REST, REST))
GOAL = m.Goal(
    primitive="forehand", positions=list(HIT), velocities=list(HIT_VELOCITIES), client_id="alice", lease=True,
    preempt=False, waypoints=[m.Waypoint(time_from_start=0.4, positions=[-0.9] + [None] * 5)],
)  # fmt: skip
STAMPS = m.Stamps(requested=1, planned=2)


@pytest.fixture(scope="module")
def primitive() -> Primitive:
    """The shipped forehand."""
    learned = learn_from_csv(DEMONSTRATIONS / "forehand.csv", ROBOT.joint_names)
    assert learned is not None
    return learned


@pytest.fixture(scope="module")
def made(primitive: Primitive) -> Made:
    """A plan of the forehand."""
    return Made(plan(primitive, motion_request(GOAL, primitive, ROBOT, ORIGIN), ROBOT.tick), 3, ORIGIN, 1.25)


@pytest.fixture(scope="module")
def trajectory(made: Made) -> m.Trajectory:
    """The plan as a message with samples."""
    return sampled_message(made, GOAL, "g", ROBOT, STAMPS)


def test_the_trajectory_has_every_sample(made: Made, trajectory: m.Trajectory):
    """From the start to rest, with the index of the hit and the goal's fields for the controller."""
    samples = made.plan.samples()
    assert (trajectory.goal_id, trajectory.client_id, trajectory.lease, trajectory.preempt) == (
        "g",
        "alice",
        True,
        False,
    )
    assert (trajectory.epoch, trajectory.start_time, trajectory.dt) == (7, 3.5, 0.001)
    assert trajectory.count == round(made.plan.total_duration * 1000) + 1
    positions = matrix(trajectory.positions, trajectory.count, JOINTS, "positions")
    velocities = matrix(trajectory.velocities, trajectory.count, JOINTS, "velocities")
    assert np.array_equal(positions, samples.positions)
    assert trajectory.hit_index == 1000
    assert np.abs(positions[1000] - HIT).max() < 1e-9
    assert np.abs(velocities[1000] - HIT_VELOCITIES).max() < 1e-9
    assert not velocities[-1].any()
    assert trajectory.stamps == STAMPS


@pytest.mark.parametrize("include", [False, True])
def test_the_reply_has_samples_only_on_request(made: Made, trajectory: m.Trajectory, include: bool):
    """It is encoded and decoded without change."""
    reply = goal_reply(made, "g", trajectory if include else None, ROBOT)
    assert (reply.trajectory is not None) == include
    assert (reply.goal_id, reply.start_time, reply.duration) == ("g", 3.5, 1.0)
    assert reply.total_duration == made.plan.total_duration > 1.0
    assert (reply.positions, reply.velocities, reply.alternative) == (list(HIT), list(HIT_VELOCITIES), 3)
    assert reply.report.basis_count == made.plan.report.basis_count
    assert reply.report.deviation is not None
    assert len(reply.report.deviation.by_limits.max) == JOINTS
    assert reply.report.certified is True
    assert reply.report.solve_ms == 1.25
    assert decode(encode(reply), m.GoalReply, max_bytes=1 << 20) == reply
    for vector in (reply.report.extremes.jerks, reply.report.margin.positions, reply.report.imitation_rms):
        assert len(vector) == JOINTS


def test_the_published_plan_has_limits_waypoints_and_demonstration(
    made: Made, trajectory: m.Trajectory, primitive: Primitive
):
    """The demonstration is scaled to the plan's duration."""
    said = plan_message(made, trajectory, GOAL, primitive)
    assert decode(encode(said), m.Plan, max_bytes=1 << 20) == said
    assert (said.primitive, said.waypoints, said.goal_id) == ("forehand", GOAL.waypoints, "g")
    assert said.limits.velocities == ROBOT.limits.velocities.tolist()
    demonstration = matrix(said.demonstration, said.hit_index + 1, JOINTS, "demonstration")
    assert np.abs(demonstration[0] - ROBOT.home).max() < 1e-3
    assert np.abs(demonstration[-1] - HIT).max() < 1e-3


def test_the_executed_trajectory_is_sent_as_polynomials(made: Made):
    """Evaluated at the sample times they are equal to the samples."""
    message = executed_message(made, GOAL, "g", ROBOT, STAMPS)
    assert message.positions is None
    assert message.pieces
    coefficients = np.frombuffer(message.pieces.coefficients).reshape(-1, JOINTS, 6)
    times = np.arange(message.count) * message.dt
    evaluated = Trajectory(np.array(message.pieces.breaks), coefficients).sample(times)
    assert np.array_equal(evaluated.positions, made.plan.samples().positions)
    assert len(encode(message)) < 40_000


def test_a_long_motion_is_sent_with_every_nth_sample_and_polynomials(primitive: Primitive):
    """`dt` is the interval between these samples."""
    goal = m.Goal(primitive="forehand", positions=list(HIT), duration=45.0)
    made = Made(plan(primitive, motion_request(goal, primitive, ROBOT, ORIGIN), ROBOT.tick), 0, ORIGIN, 1.0)
    message = sampled_message(made, goal, "g", ROBOT, STAMPS)
    assert message.dt == pytest.approx(0.003)
    assert message.pieces
    positions = matrix(message.positions, message.count, JOINTS, "positions")
    assert np.abs(positions[message.hit_index] - HIT).max() < 1e-3
    assert np.abs(positions[-1] - made.plan.trajectory.sample(made.plan.trajectory.breaks[-1:]).positions[0]).max() == 0
    said = plan_message(made, message, goal, primitive)
    assert decode(encode(said), m.Plan, max_bytes=4 << 20) == said
