"""Goals and plans that are refused while the arm holds or plays another motion."""

from harness import Reference, Stack
from strike_requests import HOME, epoch, execute, refused, step_into, strike, trajectory_of

from protocol import messages as m


def test_refused_goals_leave_the_motion_bit_identical(stack: Stack):
    """A run with refused goals at every tenth has the same states as a run without."""
    trajectory = trajectory_of(stack)
    seed = stack.run + 1
    runs = []
    for disturbing in (False, True):
        stack.reset(seed=seed)
        execute(stack, trajectory, epoch=epoch(stack), goal_id=f"identical {disturbing}")
        for tenth in range(11):
            stack.step_to(20 + 100 * tenth)
            if disturbing:
                assert stack.refused_goal(primitive="forehand", positions=[9.0] * 6).code == "limit"
                assert stack.refused_goal(primitive="lob", positions=HOME).code == "unknown_primitive"
                assert stack.refused_goal(primitive="forehand", positions=HOME, preempt=False).code == "busy"
                assert refused(stack, trajectory, epoch=0).code in ("late", "superseded")
        stack.step_to(1500)
        runs.append(stack.state_bodies())
    assert runs[0] == runs[1]


def test_a_plan_in_flight_when_canceled_is_superseded(stack: Stack):
    """A plan of an earlier epoch is refused, after a cancel or after another plan; nothing moves."""
    trajectory = trajectory_of(stack)
    stack.cancel()
    refusal = refused(stack, trajectory)
    assert (refusal.code, refusal.detail["goal_id"]) == ("superseded", trajectory.goal_id)
    stack.step(100)
    assert not Reference(stack.commands()).velocities.any()
    fresh = trajectory_of(stack)
    execute(stack, fresh)
    assert refused(stack, fresh, goal_id="overtaken").code == "superseded"


def test_a_plan_that_misses_its_instant_is_late(stack: Stack):
    """A plan whose first tick has passed is refused."""
    trajectory = trajectory_of(stack)
    stack.step(20)
    refusal = refused(stack, trajectory)
    assert (refusal.code, refusal.detail["goal_id"]) == ("late", trajectory.goal_id)


def test_a_plan_that_would_jump_is_refused(stack: Stack):
    """The first sample must equal the reference at that time."""
    planned = strike(stack, plan_only=True, include_trajectory=True, start=m.Start(positions=[0.1, *HOME[1:]]))
    assert planned.trajectory is not None
    refusal = refused(stack, planned.trajectory)
    assert (refusal.code, refusal.detail["field"]) == ("invalid_goal", "positions")
    assert "joint_1" in refusal.message


def test_the_same_goal_twice_is_played_once(stack: Stack):
    """A repeated goal gets the same reply. The same id with another body, or sent to the controller, is a duplicate."""
    body = {"primitive": "forehand", "positions": HOME, "duration": 0.5, "goal_id": "once"}
    first = stack.goal(**body)
    assert stack.goal(**body) == first
    stack.finish(first)
    assert stack.goal(**body) == first
    stack.step(100)
    assert stack.status().mode == "holding"
    refusal = stack.refused_goal(**{**body, "duration": 0.6})
    assert (refusal.code, refusal.detail["goal_id"]) == ("duplicate", "once")
    refusal = refused(stack, trajectory_of(stack), goal_id="once", epoch=epoch(stack))
    assert (refusal.code, refusal.detail["goal_id"]) == ("duplicate", "once")


def test_a_goal_that_does_not_preempt_is_busy(stack: Stack):
    """It is refused as `busy`, naming the running goal, until that goal has ended."""
    first = strike(stack)
    step_into(stack, first, 5)
    refusal = stack.refused_goal(primitive="forehand", positions=HOME, preempt=False)
    assert (refusal.code, refusal.detail["goal_id"]) == ("busy", first.goal_id)
    assert stack.finish(first).outcome == "succeeded"
    second = stack.goal(primitive="forehand", positions=HOME, preempt=False)
    assert stack.finish(second).outcome == "succeeded"
