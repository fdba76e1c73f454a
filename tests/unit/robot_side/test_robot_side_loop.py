"""The loop of the robot side on a fake bus: setpoints, logs and replies."""

import dataclasses
import logging
import threading
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from examples.stand_in_driver import StandIn
from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from robot.description import load_robot
from services.common.robot_side.backend import Abilities, Observation, Setpoint
from services.common.robot_side.clocks import keep_time
from services.common.robot_side.controller_presence import HANG_S, ControllerPresence
from services.common.robot_side.loop import RobotLoop

ROBOT = load_robot()
HOME, STILL = ROBOT.home.tolist(), [0.0] * ROBOT.joint_count


class FakeBus:
    """A bus without subscribers."""

    def publisher(self, *_: object, **__: object) -> SimpleNamespace:
        """Return a publisher that discards messages."""
        return SimpleNamespace(put=lambda _: None)

    def take_puts(self) -> list[str]:
        """Return no requests sent as publications."""
        return []


class FakeRequest:
    """A request that records its replies."""

    def __init__(self, topic: topics.Query, request: m.Request) -> None:
        self.topic, self.replies = topic, []
        self.request = request

    def decode(self) -> m.Request:
        """Return the request."""
        return self.request

    def reply(self, answer: Any) -> None:
        """Record a reply."""
        self.replies.append(answer)

    refuse = reply


class Reflexive(StandIn):
    """A robot with a delay of one tick, in the condition `reflex` until three ticks after `recover`."""

    abilities = Abilities(delay_ticks=1, modes=("position",), torques_are="measured")
    ready_at: int | None = None
    ready = False

    def observe(self) -> Observation:
        """Return the observation with the condition."""
        now = super().observe()
        self.ready |= self.ready_at is not None and now.tick >= self.ready_at
        if self.ready:
            return now
        return dataclasses.replace(now, condition="reflex", reason="joint_2 met more force than it may")

    def recover(self) -> None:
        """Become ready in three ticks."""
        self.ready_at = super().observe().tick + 3


class Recording(StandIn):
    """A robot that records its setpoints."""

    def step(self, setpoint: Setpoint) -> None:
        """Record a setpoint."""
        self.setpoints = [*getattr(self, "setpoints", []), setpoint]
        super().step(setpoint)


class Stoppable(Recording):
    """A robot in the condition `user_stopped` while `stopped` is set; `guide` sets it."""

    abilities = Abilities(modes=("torque", "teach"))
    stopped = False

    def observe(self) -> Observation:
        """Return the observation with the condition."""
        now = super().observe()
        return dataclasses.replace(now, condition="user_stopped") if self.stopped else now

    def guide(self) -> None:
        """Ignore setpoints from now on."""
        self.stopped = True

    def release(self, positions: np.ndarray) -> None:
        """Become ready at `positions`, to which the arm was moved by hand."""
        self._positions, self.stopped = positions, False
        self.begin_run()


def loop_of(backend: StandIn) -> RobotLoop:
    """Return a loop with a backend, on the paced clock."""
    return RobotLoop(FakeBus(), ROBOT, backend, "paced", logging.getLogger("test"), run=7)  # type: ignore[arg-type]


def ask(loop: RobotLoop, topic: topics.Query, request: m.Request = m.Empty()) -> FakeRequest:  # noqa: B008
    """Send a request, and return it with the replies so far."""
    asked = FakeRequest(topic, request)
    assert loop.requests.offer(asked)  # type: ignore[arg-type]
    loop.attend()
    return asked


def tick(loop: RobotLoop, command: m.Command | None = None) -> m.State:
    """Run the loop for a tick and return the state after it."""
    if command is not None:
        loop.receive(encode(command))
    loop.step()
    loop.attend()
    return loop.state_message()


def command(tick: int, **fields: Any) -> m.Command:
    """Return a command that answers `tick` of run 7."""
    still = {"accelerations": STILL, "positions": HOME, "velocities": STILL, "goal_id": None}
    return m.Command(**{"run": 7, "tick": tick, "source": "test", **still, **fields})


@pytest.mark.parametrize("body", [b"\xc1", encode(command(0, run=8))])
def test_a_refused_command_is_logged_with_its_code(body: bytes, caplog: pytest.LogCaptureFixture):
    """The command does not decode, or is of another run."""
    loop_of(StandIn(ROBOT)).receive(body)
    assert [each.__dict__["code"] for each in caplog.records] == ["bad_message"]


def test_states_report_the_newest_applied_command_minus_the_delay():
    for backend, delay in ((StandIn(ROBOT), 0), (Reflexive(ROBOT), 1)):
        loop = loop_of(backend)
        applied = [tick(loop, command(k)).applied_tick for k in range(4)]
        assert applied == [max(k - delay, -1) for k in range(4)]


def test_the_description_lists_the_abilities():
    (description,) = ask(loop_of(Reflexive(ROBOT)), topics.DESCRIPTION).replies
    assert (description.delay_ticks, description.modes, description.torques_are) == (1, ["position"], "measured")


def test_states_have_condition_and_reason():
    state = loop_of(Reflexive(ROBOT)).state_message()
    assert (state.condition, state.reason) == ("reflex", "joint_2 met more force than it may")
    assert state.brake is False


def test_an_arm_that_brakes_has_the_condition_braking():
    loop = loop_of(StandIn(ROBOT))
    tick(loop, command(0))
    states = [tick(loop) for _ in range(ROBOT.silence_ticks)]
    conditions = [state.condition for state in states]
    assert conditions == ["ready"] * (ROBOT.silence_ticks - 1) + ["braking"]
    assert states[-1].reason == "no command for 20 ticks"


def test_recover_is_answered_once_the_arm_is_ready_in_a_new_run():
    loop = loop_of(Reflexive(ROBOT))
    asked = ask(loop, topics.RECOVER)
    assert ask(loop, topics.RECOVER).replies[0].code == "busy"
    while loop.state_message().tick < 2:
        tick(loop)
        assert asked.replies == []
    tick(loop)
    (recovered,) = asked.replies
    assert recovered.condition == "ready"
    assert recovered.run > 7
    state = loop.state_message()
    assert (state.run, state.tick) == (recovered.run, 0)


@pytest.mark.parametrize("topic", [topics.RECOVER, topics.GUIDE])
def test_recover_and_guide_are_refused_while_the_arm_moves_or_turns_back(topic: topics.Query):
    """Where it turns back its velocity is 0, but its acceleration would drop within a tick."""
    loop = loop_of(Stoppable(ROBOT))
    for k, acceleration in enumerate([10.0] * 20 + [-10.0] * 20 + [-20.0]):
        tick(loop, command(k, accelerations=[acceleration, *STILL[1:]]))
        if k == 19:
            assert "the arm moves (0.200 rad/s)" in ask(loop, topic).replies[0].message
    assert "the arm moves (0.020 rad/s and accelerates)" in ask(loop, topic).replies[0].message


def test_a_setpoint_has_the_reference_at_the_end_of_the_tick():
    """An older controller's command has none: then it follows from the accelerations."""
    ahead = m.Point(positions=[0.5] * 6, velocities=[0.25] * 6)
    loop = loop_of(backend := Recording(ROBOT))
    tick(loop, command(0, next=ahead, feedforward=[2.0] * 6))
    tick(loop)
    tick(loop, command(2, accelerations=[4.0] * 6, velocities=[1.0] * 6))
    commanded, repeated, older = backend.setpoints
    assert (commanded.positions.tolist(), commanded.velocities.tolist()) == (ahead.positions, ahead.velocities)
    assert repeated.velocities == pytest.approx(np.full(6, 0.25 + 2.0 * ROBOT.tick))
    assert repeated.positions == pytest.approx(np.full(6, 0.5 + 0.25 * ROBOT.tick + 1e-6))
    assert older.velocities == pytest.approx(np.full(6, 1.0 + 4.0 * ROBOT.tick))
    assert older.positions == pytest.approx(ROBOT.home + ROBOT.tick + 2e-6)


@pytest.mark.parametrize("field", ["feedforward", "next"])
def test_a_command_with_a_reference_of_the_wrong_length_is_refused(field: str):
    loop = loop_of(StandIn(ROBOT))
    loop.receive(encode(command(0, **{field: [] if field == "feedforward" else m.Point(positions=[], velocities=[])})))
    assert loop.drive.answered_tick == -1


def test_the_loop_waits_for_a_controller_while_it_is_present_and_answers(monkeypatch: pytest.MonkeyPatch):
    now, woken = [100.0], []
    monkeypatch.setattr("services.common.robot_side.controller_presence.time.monotonic", lambda: now[0])
    controller = ControllerPresence(wake=lambda: woken.append(True))
    assert not controller.is_awaited
    controller.see("", True)
    assert (controller.is_awaited, woken) == (True, [True])
    now[0] += HANG_S
    assert not controller.starts_to_hang()
    now[0] += 0.1
    assert [controller.starts_to_hang() for _ in range(2)] == [True, False]
    assert not controller.is_awaited
    controller.note_command()
    controller.note_state()
    assert controller.is_awaited
    controller.see("", False)
    assert not controller.is_awaited
    controller.note_command()
    assert not controller.is_awaited


class RobotWithClock(StandIn):
    """A robot with its own clock: three ticks, of which the second is lost, then the end."""

    abilities = Abilities(own_clock=True)

    def __init__(self, ended: threading.Event) -> None:
        super().__init__(ROBOT)
        self._ended, self._left = ended, [1, 2, 1]

    def step(self, setpoint: Setpoint) -> None:
        """Step once more than ticks were lost."""
        for _ in range(self._left.pop()):
            super().step(setpoint)
        if not self._left:
            self._ended.set()


def test_a_robot_with_its_own_clock_sets_the_pace():
    """Ticks that the robot lost are missing from the states."""
    ended = threading.Event()
    loop = loop_of(RobotWithClock(ended))
    published: list[int] = []
    loop.publish = lambda: published.append(loop.state_message().tick)  # type: ignore[method-assign]
    keep_time([loop], ended)
    assert published == [1, 3, 4]


class RobotWithFinger(StandIn):
    """A robot with a held finger that records its targets."""

    def hold(self, targets: Mapping[str, float]) -> float | None:
        """Record the targets; the arrival time is unknown."""
        self.targets = targets
        return None


def test_held_joints_get_the_targets_of_a_request():
    loop = loop_of(backend := RobotWithFinger(ROBOT))
    (held,) = ask(loop, topics.HOLD, m.Hold(joints={"finger": 0.5})).replies
    assert (held, backend.targets) == (m.Held(joints={"finger": 0.5}, arrival_time=None), {"finger": 0.5})


def test_a_robot_without_held_joints_refuses_hold():
    (refusal,) = ask(loop_of(StandIn(ROBOT)), topics.HOLD, m.Hold(joints={"finger": 0.5})).replies
    assert (refusal.code, refusal.message) == ("bad_message", "this robot has no joints that are held")


def test_an_arm_that_becomes_ready_by_itself_is_held_at_its_present_position():
    """Otherwise the brake would pull it back to the position at which it was stopped."""
    loop = loop_of(backend := Stoppable(ROBOT))
    backend.guide()
    loop.step()
    backend.release(ROBOT.home + 0.3)
    loop.step()
    assert backend.setpoints[-1].positions == pytest.approx(ROBOT.home + 0.3)


def test_guiding_is_published_before_it_is_answered(monkeypatch: pytest.MonkeyPatch):
    loop, order = loop_of(Stoppable(ROBOT)), []
    monkeypatch.setattr(loop, "_state", SimpleNamespace(put=lambda state: order.append(state.condition)))
    monkeypatch.setattr(FakeRequest, "reply", lambda _, answer: order.append(answer))
    ask(loop, topics.GUIDE)
    assert order == ["user_stopped", m.Guided(condition="user_stopped")]
