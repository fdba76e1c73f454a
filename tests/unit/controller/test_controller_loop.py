"""The controller's loop amid noise on the stream of states."""

import dataclasses
import logging
import threading
import time
from typing import Any

import pytest
from msgspec import structs

from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from robot.description import RobotConfig, load_robot
from services.controller.loop import MAX_SIGHTINGS, ControllerLoop
from tests.golden.examples import EXAMPLES

CONFIG = load_robot()
NOISE = b"\xc1" * 100


class Publisher:
    """Keeps what is published."""

    def __init__(self) -> None:
        self.said: list[Any] = []

    def put(self, message: Any) -> None:
        """Keep a message."""
        self.said.append(message)


class Desk:
    """A loop in real time, and the commands it publishes."""

    def __init__(self, config: RobotConfig = CONFIG) -> None:
        self.commands: list[m.Command] = []
        self.asked: list[tuple[str, Any]] = []
        self.loop = ControllerLoop(self, config, logging.getLogger("controller"))  # type: ignore[arg-type]
        self.loop._clock = "realtime"

    def ask_later(self, topic: Any, _: object, callback: Any) -> None:
        """Stand in for the bus: note who wants which answer."""
        self.asked.append((topic.key, callback))

    def publisher(self, topic: Any, blocking: bool = False) -> Publisher:
        """Stand in for the bus."""
        publisher = Publisher()
        if topic.key == "command":
            self.commands = publisher.said
        return publisher


@pytest.fixture
def desk() -> Desk:
    """A loop that has heard nothing yet."""
    return Desk()


def state(tick: int) -> bytes:
    """Return the state of an arm at rest at home."""
    home, still = CONFIG.home.tolist(), [0.0] * CONFIG.joint_count
    saturated = [False] * CONFIG.joint_count
    return encode(
        m.State(
            run=1,
            tick=tick,
            time=tick / 1000,
            positions=home,
            velocities=still,
            torques=still,
            saturated=saturated,
            brake=False,
            applied_tick=tick - 1,
        )
    )


def test_noise_behind_a_state_does_not_take_its_place(desk: Desk):
    """The newest good state is answered, and what was refused is counted."""
    desk.loop._answer([state(5)])
    desk.loop._answer([state(6), state(7), NOISE, state(3), b""])
    assert [command.tick for command in desk.commands] == [5, 7]
    assert desk.loop._core.cycle.refused == 3


def test_noise_is_no_sign_of_life(desk: Desk):
    """However much of it comes, every wait without a state is a silent one, and the twentieth a fault."""
    desk.loop._answer([state(5)])
    assert desk.loop._silent_waits == 0
    for wait in range(1, CONFIG.silence_ticks + 1):
        desk.loop._wait_ends_ns = 0  # the wait is over
        desk.loop._answer([NOISE, NOISE])
        assert desk.loop._silent_waits == wait
        assert (desk.loop._core.fault is None) == (wait < CONFIG.silence_ticks)
    desk.loop._answer([state(6)])
    assert desk.loop._silent_waits == 0


class Watch:
    """A clock for the loop, which goes on by itself from the end of one wait to that of the next."""

    def __init__(self, desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_ns = 10**9
        self._loop = desk.loop
        monkeypatch.setattr("services.controller.loop.time.perf_counter_ns", lambda: self.now_ns)

    def silence_ms(self, held_up_ms: float = 0.0) -> float:
        """Return the time from a state to the fault, `held_up_ms` of which the loop did not run."""
        self._loop._answer([state(5)])
        began_ns = self.now_ns
        self.now_ns += int(held_up_ms * 1e6)
        while self._loop._core.fault is None:
            self.now_ns = max(self.now_ns, self._loop._wait_ends_ns)
            self._loop._answer([])
        return (self.now_ns - began_ns) / 1e6


@pytest.mark.parametrize("held_up_ms", [0.0, 0.5, 1.0, 2.5, 4.0, 5.0])
def test_silence_is_told_within_its_ticks(desk: Desk, monkeypatch: pytest.MonkeyPatch, held_up_ms: float):
    """Half a millisecond is left to tell it, even where a sim that dies holds up the core."""
    assert CONFIG.silence_ticks - 1.0 < Watch(desk, monkeypatch).silence_ms(held_up_ms) <= CONFIG.silence_ticks - 0.5


def test_silence_is_counted_in_the_ticks_of_the_arm(monkeypatch: pytest.MonkeyPatch):
    slow = Desk(dataclasses.replace(CONFIG, rate_hz=100.0))
    assert 10.0 * (CONFIG.silence_ticks - 1) < Watch(slow, monkeypatch).silence_ms() <= 10.0 * CONFIG.silence_ticks


def test_a_stall_of_the_machine_is_no_silence(desk: Desk, monkeypatch: pytest.MonkeyPatch):
    """The arm stood still as well: of the stall counts only what a dying sim takes, 5 ms and the wait it fell in."""
    stall_ms = 100.0
    assert Watch(desk, monkeypatch).silence_ms(stall_ms) > stall_ms + CONFIG.silence_ticks - 8.0


def test_within_a_wait_nothing_is_counted(desk: Desk):
    """A wait that noise cut short is waited on."""
    desk.loop._answer([state(5)])
    desk.loop._wait_ends_ns = 1 << 62
    desk.loop._answer([NOISE])
    desk.loop._answer([])
    assert desk.loop._silent_waits == 0


def test_an_arm_is_greeted_until_it_has_answered(desk: Desk, monkeypatch: pytest.MonkeyPatch):
    """What it is and where: either answer may be lost, or refused by a busy arm."""
    now_ns = [10**9]
    monkeypatch.setattr("services.controller.loop.time.monotonic_ns", lambda: now_ns[0])
    names = list(CONFIG.joint_names)
    arm = encode(structs.replace(EXAMPLES["Description"], joint_names=names, rate_hz=CONFIG.rate_hz, clock="stepped"))
    desk.loop._look_at_arm()
    assert desk.asked == []
    desk.loop._see_arm("alive/sim", True)
    for count in (1, 2, 3):
        for _ in range(3):
            desk.loop._look_at_arm()
            assert [key for key, _ in desk.asked] == ["description"] * count
        now_ns[0] += 500_000_000
    desk.asked[-1][1](arm)
    desk.loop._look_at_arm()
    assert desk.asked[-1][0] == "state"
    now_ns[0] += 500_000_000
    desk.loop._look_at_arm()
    assert desk.asked[-1][0] == "description"
    desk.asked[-1][1](arm)
    desk.loop._look_at_arm()
    desk.asked[-1][1](state(0))
    desk.loop._look_at_arm()
    assert [command.tick for command in desk.commands] == [0]
    asked = len(desk.asked)
    now_ns[0] += 10**10
    desk.loop._look_at_arm()
    assert len(desk.asked) == asked


class Question:
    """A request that notes when it is answered."""

    def __init__(self, topic: topics.Query, request: Any, answered: list[str]) -> None:
        self.topic, self._request, self._answered = topic, request, answered

    def decode(self) -> Any:
        """Return the request."""
        return self._request

    def reply(self, _: object) -> None:
        """Note the answer."""
        self._answered.append(self.topic.key)

    refuse = reply


def test_a_stop_is_attended_to_before_what_only_reads(desk: Desk):
    answered: list[str] = []
    for inbox, topic, request in (
        (desk.loop._requests, topics.RESULT, m.ResultRequest(goal_id="a")),
        (desk.loop._requests, topics.STATUS_QUERY, m.Empty()),
        (desk.loop._urgent, topics.CANCEL, m.Cancel()),
    ):
        assert inbox.offer(Question(topic, request, answered))  # type: ignore[arg-type]
    for tick in range(3):
        desk.loop._answer([state(tick)])
        desk.loop._attend()
    assert answered == ["cancel", "result", "status"]


def test_one_request_a_tick(desk: Desk):
    """A stop, then a motion, then what only reads."""
    answered: list[str] = []
    question = Question(topics.STATUS_QUERY, m.Empty(), answered)
    stop = Question(topics.CANCEL, m.Cancel(), answered)
    play = Question(topics.EXECUTE, None, answered)
    assert desk.loop._requests.offer(question)  # type: ignore[arg-type]
    assert desk.loop._checked.offer((play, None))  # type: ignore[arg-type]
    assert desk.loop._urgent.offer(stop)  # type: ignore[arg-type]
    desk.loop._core.execute = lambda *_: m.Accepted(goal_id="g", start_time=0.0)  # type: ignore[method-assign]
    for count, key in enumerate(("cancel", "execute", "status"), 1):
        desk.loop._answer([state(count)])
        for _ in range(3):
            desk.loop._attend()
            assert (len(answered), answered[-1]) == (count, key)


def test_requests_are_attended_to_while_the_arm_is_silent(desk: Desk):
    """One in every wait without a state, however often the loop is woken within it."""
    answered: list[str] = []
    for goal_id in "ab":
        assert desk.loop._requests.offer(Question(topics.RESULT, m.ResultRequest(goal_id=goal_id), answered))  # type: ignore[arg-type]
    for expected in (1, 2):
        desk.loop._wait_ends_ns = 0  # the wait is over
        desk.loop._answer([])
        for _ in range(3):
            desk.loop._wait_ends_ns = 1 << 62
            desk.loop._answer([])
            desk.loop._attend()
            assert len(answered) == expected


@pytest.mark.parametrize("inbox", ["_urgent", "_requests", "_checked"])
def test_a_request_does_not_wait_for_the_next_state(desk: Desk, inbox: str):
    """It ends the wait for one, and stays where it is until it is attended to."""
    desk.loop._wait_ends_ns = time.perf_counter_ns() + 10 * 1_000_000_000
    asker = threading.Timer(0.05, lambda: getattr(desk.loop, inbox).offer(None))
    asker.start()
    began = time.monotonic()
    assert desk.loop._receive() == []
    assert time.monotonic() - began < 5.0
    assert getattr(desk.loop, inbox).take() is None
    asker.join()


def see(desk: Desk, client: str, alive: bool = True) -> None:
    """Let the loop's watch hear of a client."""
    desk.loop._see_client(f"volley/arm/alive/client/{client}", alive)


def test_a_flood_of_notices_costs_every_lease(desk: Desk):
    """The queue is bounded; what it has lost might be that the holder of the arm has gone."""
    see(desk, "alice")
    desk.loop._attend()
    assert desk.loop._core._clients == {"alice"}
    see(desk, "bob")
    for k in range(MAX_SIGHTINGS - 1):
        see(desk, f"flood-{k}")
    see(desk, "bob", alive=False)  # this one is lost
    for _ in range(MAX_SIGHTINGS + 1):
        desk.loop._attend()
    assert desk.loop._core._clients == set()
    see(desk, "carol")
    desk.loop._attend()
    assert desk.loop._core._clients == {"carol"}


def test_a_flood_that_goes_on_is_told_once_a_second(desk: Desk, caplog: pytest.LogCaptureFixture):
    for _ in range(20):
        for k in range(MAX_SIGHTINGS + 2):
            see(desk, f"flood-{k}")
        desk.loop._attend()
    assert len(caplog.records) == 1


def test_what_is_logged_of_a_goal_has_its_id_as_a_field(desk: Desk, caplog: pytest.LogCaptureFixture):
    caplog.set_level(logging.INFO)
    stamps = m.Stamps(requested=1, planned=2)
    desk.loop._core.ledger.ended.append(m.Result(goal_id="g-1", outcome="succeeded", stamps=stamps))
    desk.loop._tell()
    assert [each.__dict__["goal_id"] for each in caplog.records] == ["g-1"]


def test_what_is_logged_of_a_refusal_has_its_code_as_a_field(desk: Desk, caplog: pytest.LogCaptureFixture):
    desk.loop._answer([NOISE])
    assert [each.__dict__["code"] for each in caplog.records] == ["bad_message"]


@pytest.mark.parametrize("hear", ["_meet_arm", "_catch_up"])
def test_an_answer_that_is_none_ends_nothing(desk: Desk, hear: str, caplog: pytest.LogCaptureFixture):
    """Anyone on an open bus may answer what the arm is asked."""
    if hear == "_meet_arm":
        desk.loop._answers.offer(lambda: desk.loop._meet_arm(NOISE))
    else:
        desk.loop._catch_up(NOISE)
    desk.loop._look_at_arm()
    assert [each.__dict__["code"] for each in caplog.records] == ["bad_message"]


def test_faults_are_logged_as_they_come_and_go(desk: Desk, caplog: pytest.LogCaptureFixture):
    """Once each, whether or not a goal ends with them."""
    caplog.set_level(logging.INFO)
    desk.loop._answer([state(0)])
    for fault in ("hot", "hot", None):
        desk.loop._core.fault = fault
        desk.loop._tell()
    assert caplog.messages == ["in fault: hot", "out of the fault"]
    assert caplog.records[0].__dict__["code"] == "fault"
