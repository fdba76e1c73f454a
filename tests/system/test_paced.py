"""The clock `paced`: the pace of the wall clock where the machine can, slower where it cannot, and no fault for it."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest
from harness import ROBOT, SERVICES, Stack, joined, running, wait_for, wait_for_controller

from protocol import messages as m
from protocol import topics
from protocol.errors import Refusal
from services.common.cli import Options, free_endpoint
from services.common.supervisor import Supervisor, command_lines

pytestmark = pytest.mark.realtime

SILENCE = ROBOT.silence_ticks
HANG_S = 2.0
HANGS = "has not answered tick"
"""What the sim logs where it has waited so long."""
UNPRIVILEGED = ["setpriv", "--bounding-set=-sys_nice,-ipc_lock", "--inh-caps=-sys_nice,-ipc_lock"]
BUSY = [sys.executable, "-c", "while True: pass"]


@pytest.fixture
def stack(tmp_path: Path) -> Iterator[Stack]:
    """Sim, planner and controller, paced, the stream of states listened to."""
    with running(tmp_path, clock="paced") as stack:
        stack.listen(topics.STATE)
        yield stack


def test_robot_time_keeps_to_the_wall_clock(stack: Stack):
    """Never faster; within a few percent in at least one of many looks, since the machine may be busy."""

    def pace() -> float:
        began, first = time.monotonic(), stack.state().time
        time.sleep(1.0)
        last, ended = stack.state().time, time.monotonic()
        ratio = (last - first) / (ended - began)
        assert ratio < 1.05
        return ratio

    wait_for(lambda: pace() > 0.95, "robot time to run at the pace of the wall clock")


def test_a_run_is_named_and_served_as_in_real_time(stack: Stack):
    """By the time of its start; no step by request; a reset and a push while states and commands go back and forth."""
    description = stack.bus.ask(topics.DESCRIPTION, m.Empty())
    assert description.clock == "paced"
    assert 0 < time.time_ns() - description.run < 60e9
    with pytest.raises(Refusal) as caught:
        stack.step(1)
    assert caught.value.code == "wrong_clock"
    assert stack.bus.ask(topics.SIM_RESET, m.Reset()).run > description.run
    assert stack.bus.ask(topics.SIM_DISTURB, m.Disturb(kind="torque", values=[1.0] * 6, duration=0.1)).start_time > 0
    assert stack.finish(stack.strike()).outcome == "succeeded"


def test_goals_succeed_without_rights_beside_busy_processes(tmp_path: Path):
    """A goal of 2 s is played to its end, and no command is missed, however long it takes."""
    endpoint = free_endpoint()
    lines = command_lines(Options(listen=(endpoint,)), {"library": tmp_path / "library"})
    prefix = UNPRIVILEGED if os.geteuid() == 0 and shutil.which("setpriv") else []
    supervisor = Supervisor({name: [*prefix, *lines[name]] for name in SERVICES}, logs=tmp_path)
    with busy(2), supervisor as services, joined(endpoint) as bus:
        services.wait_ready(bus)
        stack = Stack(services, bus, endpoint, tmp_path, ROBOT, False)
        wait_for_controller(stack)
        stack.bus.ask(topics.SIM_RESET, m.Reset())
        reply = stack.goal(positions=[0.5, *stack.home[1:]], duration=2.0)
        wait_for(lambda: stack.result(reply.goal_id).outcome != "running", "the goal to end", patience=300.0)
        assert stack.result(reply.goal_id).outcome == "succeeded"
        assert stack.status().cycle.missed == 0
        assert not prefix or "SCHED_FIFO" in stack.processes.log("sim").read_text()


def test_a_sim_that_stalls_faults_nothing(stack: Stack):
    """It is stopped for a second in the middle of a motion, which then goes on where it was."""
    reply = stack.under_way()
    stack.processes.signal("sim", signal.SIGSTOP)
    time.sleep(1.0)
    stack.processes.signal("sim", signal.SIGCONT)
    assert stack.finish(reply).outcome == "succeeded"


def test_a_killed_controller_leaves_a_braked_arm(stack: Stack):
    """At the twentieth tick after its last command, inside the limits; the next controller finds it braked.

    Its token is gone at once, so nobody waits for it as for one that hangs.
    """
    stack.under_way()
    stack.drain(topics.STATE)
    stack.processes.signal("controller", signal.SIGKILL)
    wait_for(lambda: stack.state().brake, "the arm to brake")
    check_brake(stack)
    assert HANGS not in stack.processes.log("sim").read_text()
    stack.processes.start("controller")
    stack.services.wait_ready(stack.bus)
    wait_for(lambda: stack.mode() == "fault", "the next controller in fault")
    stack.recover()
    assert stack.finish(stack.strike()).outcome == "succeeded"


def test_a_killed_sim_aborts_the_motion(stack: Stack):
    """The controller is in fault as soon as the token is gone; the next sim is served as the first one was."""
    reply = stack.under_way()
    stack.processes.signal("sim", signal.SIGKILL)
    wait_for(
        lambda: "in fault: the arm is gone" in stack.processes.log("controller").read_text(), "the controller in fault"
    )
    stack.processes.start("sim")
    stack.services.wait_ready(stack.bus)
    wait_for(lambda: stack.mode() == "holding", "the controller to serve the next run")
    result = stack.result(reply.goal_id)
    assert result.outcome == "aborted"
    assert "the arm is gone" in result.reason
    assert stack.finish(stack.strike()).outcome == "succeeded"


def test_a_controller_that_hangs_is_waited_for_two_seconds(stack: Stack):
    """Then the arm brakes; once it answers again, every tick waits for it as before."""
    stack.under_way()
    stack.drain(topics.STATE)
    stopped = time.monotonic()
    stack.processes.signal("controller", signal.SIGSTOP)
    wait_for(lambda: stack.state().brake, "the arm to brake")
    assert time.monotonic() - stopped >= HANG_S
    check_brake(stack)
    assert HANGS in stack.processes.log("sim").read_text()
    stack.processes.signal("controller", signal.SIGCONT)
    wait_for(lambda: stack.mode() == "fault", "the controller in fault")
    stack.recover()
    missed = stack.status().cycle.missed
    assert stack.finish(stack.strike()).outcome == "succeeded"
    assert stack.status().cycle.missed == missed


def test_time_passes_without_a_controller(tmp_path: Path):
    """As in real time: the arm holds its pose and says so."""
    with running(tmp_path, names=("sim",), clock="paced") as stack:
        first = stack.state().tick
        wait_for(lambda: stack.state().tick > first + 100, "time to pass")
        assert stack.state().positions == pytest.approx(stack.home, abs=1e-6)


def check_brake(stack: Stack) -> None:
    """Of the states since the last look: the brake came at its tick, and the stop keeps the limits on acceleration."""

    def rests() -> bool:
        truth = stack.state().truth
        return truth is not None and max(map(abs, truth.velocities)) < 1e-3

    wait_for(rests, "the arm to rest")
    states = stack.drain(topics.STATE)
    first = next(k for k, state in enumerate(states) if state.brake)
    assert states[first].tick == states[first].applied_tick + SILENCE + 1
    velocities = np.array([state.truth.velocities for state in states[first:] if state.truth])
    assert np.abs(velocities[0]).max() > 0.1
    accelerations = np.diff(velocities, axis=0) * ROBOT.rate_hz
    assert np.all(np.abs(accelerations) <= ROBOT.limits.accelerations * 1.01)


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Keep `count` processes busy for the length of the block."""
    with ExitStack() as ended:
        for _ in range(count):
            process = ended.enter_context(subprocess.Popen(BUSY))
            ended.callback(process.kill)
        yield
