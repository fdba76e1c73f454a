"""Lost messages, a dead controller and a new run in the middle of a motion."""

import signal
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from harness import ROBOT, Stack, running, wait_for

from protocol import messages as m
from protocol import topics
from protocol.errors import Refusal
from tools.demo.strikes import goal

Stream = Literal["state", "command"]
HOME = ROBOT.home.tolist()
STREAMS = pytest.mark.parametrize("stream", ["state", "command"])
SILENCE = ROBOT.silence_ticks


def strike_and_lose(stack: Stack, stream: Stream, ticks: int) -> m.GoalReply:
    """Begin a strike; 300 ticks into it, drop the messages of one stream for `ticks` ticks."""
    reply = stack.bus.ask(topics.GOAL, goal())
    stack.step_to(round(reply.start_time * 1000) + 300)
    stack.bus.ask(topics.SIM_DISTURB, m.Disturb(kind="loss", stream=stream, duration=ticks / 1000))
    return reply


def reset_fault(stack: Stack) -> m.ModeReply:
    """Ask the controller to leave its fault."""
    return stack.bus.ask(topics.RESET, m.Empty())


def speed(stack: Stack) -> float:
    """Return the true speed of the fastest joint now, rad/s."""
    truth = stack.state().truth
    assert truth is not None
    return float(np.abs(truth.velocities).max())


@STREAMS
def test_the_arm_brakes_at_the_twentieth_lost_message(stack: Stack, stream: Stream):
    """The arm brakes to rest; goals are refused until a reset, which does not move the arm."""
    reply = strike_and_lose(stack, stream, SILENCE)
    lost = stack.tick
    stack.step(SILENCE)
    assert not stack.state().brake
    stack.step(1)
    assert stack.state().brake
    assert next(state.tick for state in stack.states() if state.brake) == lost + SILENCE + 1
    assert stack.states()[-1].applied_tick == lost
    status = stack.status()
    assert status.mode == "fault"
    assert "braked" in (status.fault or "")
    assert stack.result(reply.goal_id).outcome == "aborted"
    with pytest.raises(Refusal) as caught:
        reset_fault(stack)
    assert caught.value.code == "busy"
    refusal = stack.refused_goal(primitive="forehand", positions=HOME)
    assert (refusal.code, refusal.detail["fault"]) == ("fault", status.fault)
    stack.step(500)
    assert speed(stack) < 1e-3
    at_rest = stack.state()
    assert at_rest.brake
    assert stack.refused_goal(primitive="forehand", positions=HOME).code == "fault"
    assert reset_fault(stack).mode == "holding"
    stack.step(100)
    assert not stack.state().brake
    held = [state.positions for state in stack.states()[-100:]]
    assert np.abs(np.array(held) - at_rest.positions).max() < 1e-5
    back = stack.goal(primitive="forehand", positions=HOME)
    assert stack.finish(back).outcome == "succeeded"
    assert stack.state().positions == pytest.approx(HOME, abs=1e-4)


def test_the_brake_keeps_the_acceleration_limits(stack: Stack):
    """The measured motion stops inside the acceleration limits."""
    strike_and_lose(stack, "command", 1000)
    stack.step(500)
    braking = np.array([state.truth.velocities for state in stack.states() if state.brake and state.truth])
    assert np.abs(braking[0]).max() > 1.0
    assert np.abs(braking[-1]).max() < 1e-3
    accelerations = np.diff(braking, axis=0) * 1000
    assert np.all(np.abs(accelerations) <= ROBOT.limits.accelerations * 1.01)


def test_a_new_run_aborts_the_goal(stack: Stack):
    """The controller holds the pose of the new run, and goals start from there."""
    reply = stack.bus.ask(topics.GOAL, goal())
    stack.step(400)
    stack.reset(positions=[0.3, 0.5, 0.8, 0.0, 0.0, 0.0])
    result = stack.result(reply.goal_id)
    assert result.outcome == "aborted"
    assert "run" in result.reason
    assert stack.status().mode == "holding"
    stack.step(50)
    assert all(command.positions == [0.3, 0.5, 0.8, 0.0, 0.0, 0.0] for command in stack.commands())
    back = stack.goal(primitive="forehand", positions=HOME)
    assert stack.finish(back).outcome == "succeeded"


def test_a_silent_controller_stops_the_stepped_clock(stack: Stack):
    """The step is refused with the tick reached; time goes on once the controller answers."""
    stack.step(10)
    controller = stack.services.running["controller"]
    controller.send_signal(signal.SIGSTOP)
    try:
        with pytest.raises(Refusal) as caught:
            stack.step(5)
    finally:
        controller.send_signal(signal.SIGCONT)
    assert caught.value.code == "unavailable"
    assert caught.value.detail["service"] == "controller"
    reached = caught.value.detail["tick"]
    stack.step(5)
    assert stack.tick == reached + 5


@pytest.mark.realtime
def test_a_killed_controller_leaves_a_braked_arm(tmp_path: Path):
    """In real time the arm brakes and holds; a new controller starts in fault, which a reset leaves."""
    with running(tmp_path, clock="realtime") as stack:
        stack.recover()
        reply = stack.goal(primitive="forehand", positions=[0.5, *HOME[1:]], duration=3.0)
        wait_for(lambda: stack.state().time > reply.start_time + 1.0, "the motion to be under way")
        controller = stack.services.running["controller"]
        controller.kill()
        controller.wait()
        wait_for(lambda: stack.state().brake, "the arm to brake")
        wait_for(lambda: speed(stack) < 1e-3, "the arm to rest")
        pose = stack.state().positions
        stack.services.start("controller")
        wait_for(lambda: stack.mode() == "fault", "the next controller in fault")
        assert stack.refused_goal(primitive="forehand", positions=HOME).code == "fault"
        assert stack.state().positions == pytest.approx(pose, abs=1e-3)
        stack.recover()
        assert stack.state().positions == pytest.approx(pose, abs=1e-3)
        wait_for(lambda: succeeds(stack), "a goal to succeed", patience=60.0)


def succeeds(stack: Stack) -> bool:
    """Return whether a small goal is played to its end; a stall of the machine may abort it."""
    try:
        reply = stack.goal(primitive="forehand", positions=HOME, duration=1.0)
    except Refusal:
        stack.recover()
        return False
    wait_for(lambda: stack.result(reply.goal_id).outcome != "running", "the goal to end")
    return stack.result(reply.goal_id).outcome == "succeeded"
