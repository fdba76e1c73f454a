"""The controller's loop in real, paced and stepped time, and its end."""

import threading
import time
from collections.abc import Callable

import pytest

from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from tests.unit.controller.running_loop import RunningLoop
from tests.unit.controller.stand_ins import CONFIG, state, staying
from tools.drill.harness.waiting import PATIENCE_S, eventually


@pytest.fixture
def in_motion(
    start_loop: Callable[..., RunningLoop], monkeypatch: pytest.MonkeyPatch
) -> Callable[[m.Clock], RunningLoop]:
    """Return a function that starts a loop with a motion, whose end would wait for long."""
    monkeypatch.setattr("services.controller.loop.FAREWELL_S", 2 * PATIENCE_S)

    def start(arm_clock: m.Clock) -> RunningLoop:
        running = start_loop(arm_clock, clock=time.perf_counter_ns)
        running.turn(state(0))
        running.ask(topics.EXECUTE, staying(5, 1))
        return running

    return start


@pytest.mark.parametrize("arm_clock", ["stepped", "paced"])
def test_outside_of_real_time_each_state_is_answered(start_loop: Callable[..., RunningLoop], arm_clock: m.Clock):
    """The loop answers one state a turn with a blocking publisher, because the arm waits for the answer."""
    running = start_loop(arm_clock)
    running.turn(state(0), state(1))
    assert running.answered == [0]
    running.turn()
    assert running.answered == [0, 1]
    assert running.bus.blocking == {"command": True, "status": True, "ended": True}


def test_in_real_time_the_newest_state_is_answered(running: RunningLoop):
    """The publisher drops what cannot be sent at once."""
    running.turn(state(0), state(1))
    assert running.answered == [1]
    assert running.bus.blocking == {"command": False, "status": False, "ended": False}


@pytest.mark.parametrize("arm_clock", ["stepped", "paced"])
def test_outside_of_real_time_slow_states_are_no_fault(start_loop: Callable[..., RunningLoop], arm_clock: m.Clock):
    running = start_loop(arm_clock)
    running.turn(state(0))
    for _ in range(3 * CONFIG.silence_ticks):
        running.wait()
    assert running.fault is None


def test_in_paced_time_an_arm_that_is_gone_aborts_the_motion(start_loop: Callable[..., RunningLoop]):
    """A new run of the arm ends the fault."""
    running = start_loop("paced")
    running.turn(state(0))
    running.ask(topics.EXECUTE, staying(5, 1))
    running.bus.see_arm(alive=False)
    running.turn()
    assert running.fault == "the arm is gone: its token alive/sim disappeared from the bus"
    assert [result.outcome for result in running.bus.published["ended"]] == ["aborted"]
    running.bus.see_arm()
    running.turn(state(0, run=2))
    assert running.fault is None


@pytest.mark.parametrize("arm_clock", ["realtime", "stepped"])
def test_with_other_clocks_a_lost_token_is_no_fault(start_loop: Callable[..., RunningLoop], arm_clock: m.Clock):
    """In real time only missing states count; in stepped time no state is due."""
    running = start_loop(arm_clock)
    running.turn(state(0))
    running.bus.see_arm(alive=False)
    running.turn()
    assert running.fault is None


def test_in_real_time_a_controller_that_ends_gives_up_after_a_silence(
    in_motion: Callable[[m.Clock], RunningLoop],
):
    running = in_motion("realtime")
    began = time.monotonic()
    running.loop.close()
    assert time.monotonic() - began < PATIENCE_S
    assert running.answered[-1] == 0


def test_in_paced_time_a_controller_that_ends_waits_for_the_arm(
    in_motion: Callable[[m.Clock], RunningLoop],
):
    """It answers a state that arrives after a silence, and ends once the arm is gone."""
    running = in_motion("paced")

    def arrive_late() -> None:
        time.sleep(0.5)
        running.bus.send(encode(state(1)))
        eventually(lambda: running.answered[-1] == 1)
        running.bus.see_arm(alive=False)

    arm = threading.Thread(target=arrive_late)
    arm.start()
    running.loop.close()
    arm.join()
    assert running.answered[-1] == 1


def test_in_paced_time_a_controller_that_ends_does_not_wait_for_an_absent_arm(
    in_motion: Callable[[m.Clock], RunningLoop],
):
    running = in_motion("paced")
    running.bus.see_arm(alive=False)
    began = time.monotonic()
    running.loop.close()
    assert time.monotonic() - began < PATIENCE_S
