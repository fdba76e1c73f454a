"""The demo's five strikes on the stepped clock keep their promises in the plan, the reference and the measured arm."""

from dataclasses import dataclass

import numpy as np
import pytest
from harness import Stack

from motion.limits import Limits
from protocol import messages as m
from protocol import topics
from protocol.codec import matrix
from robot.description import load_robot
from tools.demo.strikes import PUSH_FOR, PUSH_FROM, STRIKES, Strike, largest, noise_request

ROBOT = load_robot()
ROUNDING = 1e-6  # part of a limit's range by which a certified plan may exceed it
MEASURED_BEYOND = 1e-3  # of a limit's range
POSITION_BOUND, VELOCITY_BOUND = 1e-5, 1e-3  # rad, rad/s at the hit without noise; 5e-7 and 1e-5 were measured


@dataclass(frozen=True, slots=True, eq=False)
class Played:
    """A strike that was played; arrays (ticks, J) over the motion and its tail."""

    strike: Strike
    reply: m.GoalReply
    plan: m.Plan
    result: m.Result
    contacts: list[m.Contact]
    commanded: np.ndarray  # position and velocity: (2, ticks, J)
    true: np.ndarray


@pytest.fixture(scope="module", params=STRIKES, ids=lambda strike: strike.title)
def played(services: Stack, request: pytest.FixtureRequest) -> Played:
    """Play one strike: place the arm, add sensor noise, strike, push, and step until the motion has ended."""
    strike: Strike = request.param
    contacts = services.listen(topics.CONTACT)
    services.reset(positions=None if strike.start is None else list(strike.start))
    while not contacts.empty():
        contacts.get()
    if strike.noise:
        services.bus.ask(topics.SIM_DISTURB, noise_request(strike))
    services.step(20)
    reply = services.bus.ask(topics.GOAL, strike.goal)
    if strike.push is not None:
        begin = reply.start_time + PUSH_FROM
        push = m.Disturb(kind="acceleration", values=list(strike.push), start_time=begin, duration=PUSH_FOR)
        services.bus.ask(topics.SIM_DISTURB, push)
    result = services.finish(reply)
    first = round(reply.start_time * ROBOT.rate_hz)
    commanded = [(command.positions, command.velocities) for command in services.commands()[first:]]
    truths = [state.truth for state in services.states()[first:]]
    true = [(truth.positions, truth.velocities) for truth in truths if truth]
    return Played(
        strike,
        reply,
        services.plan_of(reply),
        result,
        [services.next(topics.CONTACT) for _ in range(contacts.qsize())],
        np.array(commanded).swapaxes(0, 1),
        np.array(true).swapaxes(0, 1),
    )


def limits_of(plan: m.Plan) -> Limits:
    """Return the limits of the plan; on this arm none is missing."""
    said = plan.limits
    return Limits(*map(np.array, (said.positions, said.velocities, said.accelerations, said.jerks)))


def excess(values: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """Return by how much (…, J) values exceed their bounds (J,) at most, as a part of the range."""
    return float((np.maximum(low - values, values - high) / (high - low)).max())


def test_the_arm_hits_as_promised(played: Played):
    """The hit is at its exact time and within the demo's bounds; without noise it is far closer."""
    result, strike = played.result, played.strike
    assert result.outcome == "succeeded"
    assert result.hit is not None
    assert result.hit.truth_error is not None
    assert result.hit.time == pytest.approx(played.reply.start_time + played.reply.duration, abs=1e-9)
    quiet = not strike.noise
    assert largest(result.hit.truth_error.positions) < (POSITION_BOUND if quiet else strike.position_bound)
    assert largest(result.hit.truth_error.velocities) < (VELOCITY_BOUND if quiet else strike.velocity_bound)


def test_the_reference_meets_the_goal(played: Played):
    """At the hit the commands have the requested position and velocity, and at the end they are at rest."""
    hit, goal = played.plan.hit_index, played.strike.goal
    assert goal.velocities is not None
    assert np.abs(played.commanded[0, hit] - goal.positions).max() < 1e-9
    assert np.abs(played.commanded[1, hit] - goal.velocities).max() < 1e-8
    assert not played.commanded[1, -1].any()


def test_a_waypoint_is_met(played: Played):
    """The reference meets the values that a waypoint prescribes."""
    for waypoint in played.strike.goal.waypoints:
        index = round(waypoint.time_from_start * ROBOT.rate_hz)
        for wanted, got in zip((waypoint.positions, waypoint.velocities), played.commanded[:, index], strict=True):
            pairs = zip(wanted or [], got, strict=False)
            assert all(value is None or abs(value - real) < 1e-8 for value, real in pairs)


def test_the_commands_are_the_plan(played: Played):
    """The commands equal the published plan, sample by sample."""
    plan = played.plan
    for values, commanded in zip((plan.positions, plan.velocities), played.commanded, strict=True):
        assert np.array_equal(matrix(values, plan.count, 6, "plan"), commanded[: plan.count])


def test_the_reference_keeps_every_limit(played: Played):
    """Position, velocity, acceleration and jerk keep the robot's and the goal's limits at every tick."""
    assert played.reply.report.certified
    plan, limits = played.plan, limits_of(played.plan)
    accelerations = matrix(plan.accelerations, plan.count, 6, "accelerations")
    jerks = np.diff(accelerations, axis=0) * ROBOT.rate_hz
    assert excess(played.commanded[0], *limits.positions.T) <= ROUNDING
    for values, bound in (
        (played.commanded[1], limits.velocities),
        (accelerations, limits.accelerations),
        (jerks, limits.jerks),
        (np.diff(played.commanded[1], axis=0) * ROBOT.rate_hz, limits.accelerations),
    ):
        assert excess(values, -bound, bound) <= ROUNDING


def test_the_arm_keeps_its_limits(played: Played):
    """The true motion exceeds no robot limit by more than 10⁻³; without noise, up to the hit, none of the plan's."""
    checks = [(played.true, ROBOT.limits)]
    if not played.strike.noise:
        checks.append((played.true[:, : played.plan.hit_index], limits_of(played.plan)))
    for true, limits in checks:
        assert excess(true[0], *limits.positions.T) <= MEASURED_BEYOND
        assert excess(true[1], -limits.velocities, limits.velocities) <= MEASURED_BEYOND


def test_the_ball_is_struck(played: Played):
    """One contact of the racket with the ball, at the hit, makes the ball fly."""
    struck = [contact for contact in played.contacts if "racket" in contact.bodies and contact.ball_velocity]
    assert len(struck) == 1
    assert struck[0].time == pytest.approx(played.reply.start_time + played.reply.duration, abs=0.01)
    assert np.linalg.norm(struck[0].ball_velocity or ()) > 3.0


def test_the_report_describes_the_plan(played: Played):
    """Extremes, margins and active limits agree with the plan's samples and with each other."""
    report, plan = played.reply.report, played.plan
    limits = limits_of(plan)
    for name in ("positions", "velocities", "accelerations"):
        low, high = np.array(getattr(report.extremes, name)).T
        values = matrix(getattr(plan, name), plan.count, 6, name)
        assert np.all(values.min(axis=0) >= low - 1e-9)
        assert np.all(values.max(axis=0) <= high + 1e-9)
        bounds = getattr(limits, name)
        below, above = bounds.T if name == "positions" else (-bounds, bounds)
        assert np.allclose(getattr(report.margin, name), np.minimum(low - below, above - high), atol=1e-9)
    assert np.all(np.array(report.margin.jerks) >= -ROUNDING * 2 * limits.jerks)
    assert max(map(abs, report.final_error.positions)) < 1e-9
    assert {active.joint for active in report.active} <= set(ROBOT.joint_names)
    tightened = played.strike.goal.limits is not None
    assert any(active.joint == "joint_1" for active in report.active) or not tightened
    assert played.reply.total_duration >= played.reply.duration
    assert plan.count == round(played.reply.total_duration * ROBOT.rate_hz) + 1
    stamps = played.result.stamps
    assert (stamps.requested or 0) < (stamps.planned or 0) < (stamps.accepted or 0) <= (stamps.first_command or 0)
