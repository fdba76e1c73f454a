"""`revises` over the wire: a goal corrects a motion under way and imitates the rest of the demonstration."""

import dataclasses

import numpy as np
import pytest
from harness import ROBOT, Reference, Stack

from deploy.demonstrations.make_forehand import FOREHAND, HIT, HIT_VELOCITIES
from motion.demonstration import Demonstration
from motion.gaussian import plan_gaussian
from motion.plan import Plan, plan
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest
from protocol import messages as m
from protocol import topics
from robot.conversions import samples_of

LEAD = 20  # ticks from a goal to the start of its motion on the stepped clock
MOVED = np.array([0.01, -0.005, 0.005, 0.005, 0.002, -0.005])  # rad
RECORDED = np.loadtxt(FOREHAND, delimiter=",", skiprows=1)


def corrected(stack: Stack, revises: str, move: float = 1.0, **fields: object) -> m.GoalReply:
    """Correct a motion: move its hit by `move` times MOVED."""
    return stack.strike(revises=revises, positions=(HIT + move * MOVED).tolist(), **fields)


def begin_at(stack: Stack, reply: m.GoalReply, part: float) -> None:
    """Step so far that a goal sent now starts at the fraction `part` of the way from a motion's start to its hit."""
    stack.step_to(stack.ticks(reply.start_time + part * reply.duration) - LEAD)


def hit_time(reply: m.GoalReply) -> float:
    """Return when the motion hits, s on the robot's clock."""
    return reply.start_time + reply.duration


def taught() -> Primitive:
    """Return the forehand as the planner has learned it."""
    return learn(Demonstration(RECORDED[:, 0], RECORDED[:, 1:]))


def check_hit(stack: Stack, reply: m.GoalReply, positions: np.ndarray) -> None:
    """Check that the motion succeeds, is smooth, stays inside the limits, and meets the goal at the hit."""
    assert stack.finish(reply).outcome == "succeeded"
    reference = Reference(stack.commands())
    reference.check_smooth()
    reference.check_limits()
    at = stack.ticks(hit_time(reply))
    assert np.abs(reference.positions[at] - positions).max() < 1e-9
    assert np.abs(reference.velocities[at] - HIT_VELOCITIES).max() < 1e-8


@pytest.mark.parametrize("phase", [0.05, 0.3, 0.6, 0.8, 0.9, 0.95])
def test_a_correction_continues_the_motion(stack: Stack, phase: float):
    """Position, velocity, acceleration and phase are continuous; the hit keeps its time and meets the new goal."""
    first = stack.strike()
    begin_at(stack, first, phase)
    second = corrected(stack, first.goal_id, include_trajectory=True)
    assert second.report.phase == pytest.approx(phase, abs=1e-9)
    assert hit_time(second) == pytest.approx(hit_time(first), abs=1e-9)
    assert second.report.certified
    before, after = samples_of(stack.plan_of(first)), samples_of(stack.plan_of(second))
    at = round(phase * first.duration * ROBOT.rate_hz)
    assert np.abs(after.positions[0] - before.positions[at]).max() < 1e-9
    assert np.abs(after.velocities[0] - before.velocities[at]).max() < 1e-9
    assert np.abs(after.accelerations[0] - before.accelerations[at]).max() < 1e-6
    check_hit(stack, second, HIT + MOVED)
    assert stack.result(first.goal_id).outcome == "preempted"


def test_a_correction_imitates_only_the_rest(stack: Stack):
    """Without `revises` the whole demonstration is squeezed into the time left; a correction imitates only the rest."""
    first = stack.strike()
    begin_at(stack, first, 0.6)
    fields = {"positions": (HIT + MOVED).tolist(), "arrival_time": hit_time(first), "plan_only": True}
    whole, rest = (stack.strike(**fields, revises=revised) for revised in (None, first.goal_id))
    assert (whole.report.phase, rest.report.phase) == (0.0, pytest.approx(0.6, abs=1e-9))
    assert np.all(np.array(rest.report.imitation_rms) < 5)
    assert max(whole.report.imitation_rms) > 50
    assert stack.finish(first).outcome == "succeeded"


@pytest.mark.parametrize("phase", [0.2, 0.5, 0.8, 0.9])
def test_a_correction_imitates_as_well_as_the_papers_method(stack: Stack, phase: float):
    """The imitation error is at most 2 % above that of the paper's program on Gaussians for the same rest."""
    first = stack.strike()
    begin_at(stack, first, phase)
    reply = corrected(stack, first.goal_id, include_trajectory=True)
    begin = [values[0] for values in dataclasses.astuple(samples_of(stack.plan_of(reply)))]
    goal = Boundary(HIT + MOVED, np.array(HIT_VELOCITIES), np.full(len(HIT), np.nan))
    request = MotionRequest(Boundary(*begin), goal, reply.duration, ROBOT.limits, phase=reply.report.phase)
    best = plan_gaussian(taught(), request).report.imitation_rms
    assert np.all(np.array(reply.report.imitation_rms) < 1.02 * best)
    assert stack.finish(reply).outcome == "succeeded"


@pytest.mark.parametrize("named", ["first", "last"])
def test_a_chain_of_corrections(stack: Stack, named: str):
    """Corrections name the first goal or the previous one; the phase advances evenly up to the current hit time."""
    first = last = stack.strike()
    for part, duration in ((0.2, 0.9), (0.3, None), (0.5, 0.3), (0.5, None)):
        begin_at(stack, last, part)
        phase = last.report.phase + (1 - last.report.phase) * part
        revised = first if named == "first" else last
        reply = corrected(stack, revised.goal_id, 2 * part, duration=duration)
        reached = (reply.start_time - last.start_time) / last.duration
        assert reached == pytest.approx(part, abs=2e-3)
        phase = last.report.phase + (1 - last.report.phase) * reached
        assert reply.report.phase == pytest.approx(phase, abs=1e-9)
        if duration is None:
            assert hit_time(reply) == pytest.approx(hit_time(last), abs=1e-9)
        last = reply
    check_hit(stack, last, HIT + MOVED)


def test_an_arrival_time_corrects_the_hit_time(stack: Stack):
    """A correction with a later arrival time hits at that time."""
    first = stack.strike()
    begin_at(stack, first, 0.5)
    later = hit_time(first) + 0.1
    second = corrected(stack, first.goal_id, arrival_time=later)
    assert hit_time(second) == pytest.approx(later, abs=1e-9)
    check_hit(stack, second, HIT + MOVED)


def test_a_plan_of_a_correction_moves_nothing(stack: Stack):
    """A correction that is only planned leaves the motion unchanged, and cannot be corrected itself."""
    first = stack.strike()
    begin_at(stack, first, 0.5)
    planned = corrected(stack, first.goal_id, plan_only=True, goal_id="only planned")
    assert planned.report.phase == pytest.approx(0.5, abs=1e-9)
    refusal = stack.refused_goal(revises="only planned")
    assert refusal.code == "unknown_goal"
    check_hit(stack, first, np.array(HIT))


def test_the_plan_that_is_published_says_what_it_corrects(stack: Stack):
    """The plan names the corrected goal and the phase, and has the rest of the demonstration in the motion's time."""
    first = stack.strike()
    begin_at(stack, first, 0.5)
    second = corrected(stack, first.goal_id)
    published = stack.plan_of(second)
    assert (published.revises, published.phase) == (first.goal_id, pytest.approx(0.5, abs=1e-9))
    shown = np.frombuffer(published.demonstration).reshape(published.hit_index + 1, -1)
    wanted = taught().positions(np.linspace(0.5, 1.0, len(shown)))
    assert np.abs(shown - wanted).max() < 1e-6


# --- refused ----------------------------------------------------------------------------------------------


def test_a_correction_of_an_unknown_goal_is_refused(stack: Stack):
    """The code is `unknown_goal`, for plan-only goals too, and the arm does not move."""
    refusal = stack.refused_goal(revises="nobody")
    assert (refusal.code, refusal.detail["goal_id"]) == ("unknown_goal", "nobody")
    assert stack.refused_goal(revises="nobody", plan_only=True).code == "unknown_goal"
    stack.step(50)
    assert not Reference(stack.commands()).velocities.any()


def test_a_restarted_planner_knows_no_motion_under_way(stack: Stack):
    """It refuses the correction as `unknown_goal`; the motion goes on, and a goal without `revises` can replace it."""
    first = stack.strike()
    begin_at(stack, first, 0.3)
    stack.kill("planner")
    stack.start_again("planner")
    refusal = stack.refused_goal(revises=first.goal_id)
    assert (refusal.code, refusal.detail["goal_id"]) == ("unknown_goal", first.goal_id)
    second = stack.strike(arrival_time=hit_time(first) + 0.3)
    check_hit(stack, second, np.array(HIT))


@pytest.mark.parametrize("after", [-10, 1, 200, 2000])
def test_a_correction_after_the_hit_is_late(stack: Stack, after: int):
    """A correction that could only begin after the hit is refused: shortly before the hit, in the stop, and at rest."""
    first = stack.strike()
    stack.step_to(stack.ticks(hit_time(first)) + after)
    refusal = stack.refused_goal(revises=first.goal_id)
    assert (refusal.code, refusal.detail["goal_id"]) == ("late", first.goal_id)
    assert stack.finish(first).outcome == "succeeded"


def test_a_correction_of_a_motion_that_was_replaced_is_superseded(stack: Stack):
    """The replacing motion goes on, and can be corrected itself."""
    first = stack.strike()
    begin_at(stack, first, 0.3)
    other = stack.strike(duration=1.2)
    begin_at(stack, other, 0.2)
    refusal = stack.refused_goal(revises=first.goal_id)
    assert (refusal.code, refusal.detail["goal_id"]) == ("superseded", first.goal_id)
    check_hit(stack, corrected(stack, other.goal_id), HIT + MOVED)


def test_a_correction_of_a_motion_that_was_cancelled_is_superseded(stack: Stack):
    """The refusal does not disturb the stop: the arm comes to rest at the announced time."""
    first = stack.strike()
    begin_at(stack, first, 0.3)
    canceled = stack.cancel()
    refusal = stack.refused_goal(revises=first.goal_id)
    assert (refusal.code, refusal.detail["goal_id"]) == ("superseded", first.goal_id)
    stack.step_to(stack.ticks(canceled.stop_time) + 1)
    assert stack.result(first.goal_id).outcome == "canceled"


def test_a_motion_of_an_earlier_run_is_not_corrected(stack: Stack):
    """A reset starts the arm's clock again, so the correction is refused and nothing moves."""
    first = stack.strike()
    stack.reset()
    stack.step(100)
    assert stack.refused_goal(revises=first.goal_id).code in ("superseded", "late")
    stack.step(50)
    assert not Reference(stack.commands()).velocities.any()


@pytest.mark.parametrize(
    ("field", "more"),
    [
        ("primitive", {"primitive": "other"}),
        ("start", {"start": m.Start(positions=ROBOT.home.tolist()), "plan_only": True}),
        ("revises", {"method": "gaussian"}),
        ("revises", {"method": "dmp"}),
        ("revises", {"revises": ""}),
        ("revises", {"revises": "x" * 129}),
    ],
)
def test_what_contradicts_a_correction_is_invalid(stack: Stack, field: str, more: dict):
    """The refusal names the field that contradicts `revises`, and the motion goes on."""
    rows = RECORDED[:, 1:].tolist()
    stack.bus.ask(topics.LEARN, m.Learn(name="other", rate=500.0, positions=rows, replace=True))
    first = stack.strike()
    begin_at(stack, first, 0.3)
    refusal = stack.refused_goal(**{"revises": first.goal_id, **more})
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", field)
    assert stack.finish(first).outcome == "succeeded"


# --- a moving target --------------------------------------------------------------------------------------

EVERY = 10  # ticks between corrections: 100 Hz
STANDS = 50  # the target stands still for the last 50 ticks before the hit
FINAL = np.array([0.08, -0.04, 0.05, 0.06, 0.03, -0.04])  # rad from the demonstrated hit
OFF = np.array([0.03, 0.02, -0.02, 0.03, -0.015, 0.02])  # rad, of the first estimate


def estimated(left: int, duration: int) -> np.ndarray:
    """Return the estimate of the target `left` ticks before the hit; it converges like that of a ball's flight."""
    early = max(0, left - STANDS) / duration
    return HIT + FINAL + OFF * early**2 * np.cos(9 * early)


def test_a_swing_corrected_at_100_hz(stack: Stack):
    """The target moves until 50 ms before the hit; the swing is smooth and meets the last target.

    Its imitation error is at most 1.3 times that of a motion that knows the last target from the start.
    """
    duration = 1000
    first = last = stack.strike(positions=estimated(duration, duration).tolist())
    hit = stack.ticks(hit_time(first))
    left = []
    while stack.tick + LEAD + EVERY < hit:
        stack.step(EVERY)
        left.append(hit - stack.tick)
        last = stack.strike(revises=first.goal_id, positions=estimated(left[-1], duration).tolist())
        assert last.report.certified
    assert len(left) > 90
    assert left[-1] < STANDS
    check_hit(stack, last, HIT + FINAL)
    played = Reference(stack.commands())
    begin = stack.ticks(first.start_time)
    positions, accelerations = played.positions[begin : hit + 1], played.accelerations[begin:hit]
    known = known_from_the_start(played.positions[begin], duration / ROBOT.rate_hz)
    s = (np.arange(duration) + 0.5) / duration
    missed = accelerations - taught().sample(s).accelerations
    ratio = np.sqrt((missed**2).mean(axis=0)) / known.report.imitation_rms
    assert ratio.max() < 1.3, ratio
    wanted = known.sample(np.arange(duration + 1) * ROBOT.tick).positions
    assert np.abs(positions - wanted).max() < 0.03


def known_from_the_start(start: np.ndarray, duration: float) -> Plan:
    """Return the best motion to the last target, planned in one piece."""
    rest = np.zeros_like(start)
    goal = Boundary(HIT + FINAL, np.array(HIT_VELOCITIES), np.full_like(start, np.nan))
    return plan(taught(), MotionRequest(Boundary(start, rest, rest), goal, duration, ROBOT.limits))
