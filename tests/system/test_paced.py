"""The clock `paced` keeps the pace of the wall clock if the machine can; if not, it runs slower without a fault."""

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
from services.common.realtime import may_be_real_time
from services.common.supervisor import Supervisor, command_lines

pytestmark = pytest.mark.realtime

SILENCE = ROBOT.silence_ticks
HANG_S = 2.0
HANGS = "has not answered tick"
"""Logged by the sim when it has waited HANG_S for the controller."""
GONE = "in fault: the arm is gone"
"""Logged by the controller when the sim is gone."""
UNPRIVILEGED = ["setpriv", "--bounding-set=-sys_nice,-ipc_lock", "--inh-caps=-sys_nice,-ipc_lock"]
BUSY = [sys.executable, "-c", "while True: pass"]


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Start sim, planner and controller on the paced clock; the stream of states is received."""
    with running(tmp_path_factory.mktemp("paced"), clock="paced") as stack:
        stack.listen(topics.STATE)
        yield stack


@pytest.fixture
def stack(services: Stack) -> Stack:
    """Return the services, all running and without a fault, at the start of a new run."""
    if ended := services.services.ended():
        services.start_again(*ended)
    services.bus.ask(topics.SIM_RESET, m.Reset())
    services.recover()
    services.drain(topics.STATE)
    return services


def test_robot_time_keeps_to_the_wall_clock(stack: Stack):
    """Robot time is never faster than the wall clock, and in one of many measurements hardly slower.

    One is enough, because the machine may be busy.
    """

    def pace() -> float:
        began, first = time.monotonic(), stack.state().time
        time.sleep(1.0)
        last, ended = stack.state().time, time.monotonic()
        ratio = (last - first) / (ended - began)
        assert ratio < 1.05
        return ratio

    wait_for(lambda: pace() > 0.95, "robot time to run at the pace of the wall clock")


def test_a_run_is_named_and_served_as_in_real_time(stack: Stack):
    """The run's number is its start in Unix ns; steps are refused as in real time, resets and pushes are served."""
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
    """Without real-time rights and beside two busy processes a goal succeeds, however long it takes.

    No command is missed.
    """
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
        assert not prefix or "SCHED_FIFO" in stack.processes.log("controller").read_text()


@pytest.mark.skipif(not may_be_real_time(), reason="needs the right to SCHED_FIFO")
@pytest.mark.parametrize(("clock", "policy"), [("realtime", os.SCHED_FIFO), ("paced", os.SCHED_OTHER)])
def test_only_a_real_time_arm_takes_a_core_from_other_programs(tmp_path: Path, clock: m.Clock, policy: int):
    """A paced simulation that the machine is too slow for leaves a share of its core to its planner and to others."""
    with running(tmp_path, names=("sim",), clock=clock) as stack:
        assert os.sched_getscheduler(stack.services.running["sim"].pid) == policy


def test_a_stalled_sim_causes_no_fault(stack: Stack):
    """The sim is suspended for a second in mid-motion, and then continues the motion."""
    reply = stack.begin_motion()
    stack.processes.signal("sim", signal.SIGSTOP)
    time.sleep(1.0)
    stack.processes.signal("sim", signal.SIGCONT)
    assert stack.finish(reply).outcome == "succeeded"


def test_a_killed_controller_leaves_a_braked_arm(stack: Stack):
    """The arm brakes at the twentieth tick after its last command, inside its limits; a new controller starts in fault.

    The controller's token is gone at once, so the sim does not wait for it as for one that hangs.
    """
    stack.begin_motion()
    stack.drain(topics.STATE)
    killed = stack.processes.signal("controller", signal.SIGKILL)
    wait_for(lambda: stack.state().brake, "the arm to brake")
    check_brake(stack)
    assert stack.processes.logged_at("sim", HANGS, killed) is None
    stack.processes.start("controller")
    stack.services.wait_ready(stack.bus)
    wait_for(lambda: stack.mode() == "fault", "the next controller in fault")
    stack.recover()
    assert stack.finish(stack.strike()).outcome == "succeeded"


def test_a_killed_sim_aborts_the_motion(stack: Stack):
    """The controller is in fault as soon as the sim's token is gone; a new sim plays goals as before."""
    reply = stack.begin_motion()
    killed = stack.processes.signal("sim", signal.SIGKILL)
    wait_for(lambda: stack.processes.logged_at("controller", GONE, killed), "the controller in fault")
    stack.processes.start("sim")
    stack.services.wait_ready(stack.bus)
    wait_for(lambda: stack.mode() == "holding", "the controller to serve the next run")
    result = stack.result(reply.goal_id)
    assert result.outcome == "aborted"
    assert "the arm is gone" in result.reason
    assert stack.finish(stack.strike()).outcome == "succeeded"


def test_a_controller_that_hangs_is_waited_for_two_seconds(stack: Stack):
    """After two seconds the arm brakes.

    Once the controller answers again, the sim waits for it at every tick as before.
    """
    stack.begin_motion()
    stack.drain(topics.STATE)
    stopped = time.monotonic()
    sent = stack.processes.signal("controller", signal.SIGSTOP)
    wait_for(lambda: stack.state().brake, "the arm to brake")
    assert time.monotonic() - stopped >= HANG_S
    check_brake(stack)
    assert stack.processes.logged_at("sim", HANGS, sent) is not None
    stack.processes.signal("controller", signal.SIGCONT)
    wait_for(lambda: stack.mode() == "fault", "the controller in fault")
    stack.recover()
    missed = stack.status().cycle.missed
    assert stack.finish(stack.strike()).outcome == "succeeded"
    assert stack.status().cycle.missed == missed


def test_time_passes_without_a_controller(tmp_path: Path):
    """As in real time, ticks go on without a controller and the arm holds its pose."""
    with running(tmp_path, names=("sim",), clock="paced") as stack:
        first = stack.state().tick
        wait_for(lambda: stack.state().tick > first + 100, "time to pass")
        assert stack.state().positions == pytest.approx(stack.home, abs=1e-6)


def check_brake(stack: Stack) -> None:
    """Check the states since the last call: braking began at the right tick and kept the acceleration limits."""

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
