"""What every robot side guarantees on the bus; each runs as a process beside a planner and a controller."""

import itertools
import signal
import subprocess
from collections.abc import Iterator

import numpy as np
import pytest
from backends import COMMANDS
from harness import ROBOT, SERVICES, Stack, joined, wait_for, wait_for_controller

from protocol import messages as m
from protocol import topics
from services.common.cli import Options, free_endpoint
from services.common.single_instance import Outcome
from services.common.supervisor import Supervisor, command_lines

pytestmark = pytest.mark.realtime


@pytest.fixture(params=COMMANDS, scope="module")
def robot(request: pytest.FixtureRequest) -> str:
    """The name of each robot."""
    return request.param


@pytest.fixture(scope="module")
def services(robot: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Start a robot's process, which hosts the bus, a planner and a controller; the robot must end with status 0."""
    folder, endpoint = tmp_path_factory.mktemp(robot), free_endpoint()
    lines = command_lines(Options(listen=(endpoint,)), {"library": folder / "library"})
    lines["sim"] = [*COMMANDS[robot], "--listen", endpoint]
    supervisor = Supervisor({name: lines[name] for name in SERVICES}, logs=folder)
    with supervisor as running, joined(endpoint) as bus:
        running.wait_ready(bus)
        stack = Stack(running, bus, endpoint, folder, ROBOT, False)
        wait_for_controller(stack)
        stack.listen(topics.STATE)
        process = running.running["sim"]
        yield stack
    assert process.returncode == 0


@pytest.fixture
def stack(services: Stack) -> Stack:
    """Return the services with the arm ready and at rest, whatever state the last test left.

    Earlier states are dropped.
    """
    wait_for(lambda: rests(services), "the arm to rest")
    services.recover()
    services.drain(topics.STATE)
    return services


def rests(stack: Stack) -> bool:
    """Return whether the measured velocities are those of an arm at rest."""
    return max(map(abs, stack.state().velocities)) < 1e-3


def test_it_describes_itself(stack: Stack):
    description = stack.bus.ask(topics.DESCRIPTION, m.Empty())
    assert description.joint_names == list(ROBOT.joint_names)
    assert description.rate_hz == ROBOT.rate_hz
    assert description.limits.velocities == ROBOT.limits.velocities.tolist()
    assert (description.clock, description.delay_ticks) == ("paced", 0)
    assert "torque" in description.modes
    assert description.torques_are == "commanded"
    assert description.run == stack.state().run


def test_it_publishes_every_tick_once(stack: Stack):
    first = stack.state()
    wait_for(lambda: stack.state().tick > first.tick + 200, "time to pass")
    states = stack.drain(topics.STATE)
    ticks = [state.tick for state in states]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    assert {state.run for state in states} == {first.run}
    assert all(state.time == state.tick / ROBOT.rate_hz for state in states)
    assert {(state.condition, state.reason, state.brake) for state in states} == {("ready", "", False)}


def test_a_goal_is_played_and_every_tick_answered(stack: Stack):
    missed = stack.status().cycle.missed
    result = stack.finish(stack.strike())
    assert result.outcome == "succeeded"
    assert result.hit is not None
    assert np.abs(result.hit.position_error).max() < 1e-4
    assert np.abs(result.hit.velocity_error).max() < 2e-2
    assert stack.status().cycle.missed == missed


def test_commands_contain_the_next_reference(stack: Stack):
    """`next` is the state of the following command, and `feedforward` leads to its velocity."""
    stack.listen(topics.COMMAND)
    stack.drain(topics.COMMAND)
    stack.finish(stack.strike())
    commands = stack.drain(topics.COMMAND)
    assert any(command.goal_id for command in commands)
    for now, then in itertools.pairwise(commands):
        assert now.next is not None
        assert now.feedforward is not None
        assert (now.next.positions, now.next.velocities) == (then.positions, then.velocities)
        reached = np.array(now.velocities) + np.array(now.feedforward) * ROBOT.tick
        assert reached == pytest.approx(then.velocities, abs=1e-9)


def test_silence_brakes_it_and_recovery_begins_a_new_run(stack: Stack):
    """After silence the arm brakes and goals are refused with its reason.

    A recovery requires an arm at rest, leaves it where it stands, and begins a new run.
    """
    stack.begin_motion()
    run = stack.state().run
    stack.processes.signal("controller", signal.SIGKILL)
    wait_for(lambda: stack.state().brake, "the arm to brake")
    while not (state := stack.next(topics.STATE)).brake:
        pass
    assert (state.condition, state.reason) == ("braking", f"no command for {ROBOT.silence_ticks} ticks")
    wait_for(lambda: rests(stack), "the arm to rest")
    stack.processes.start("controller")
    wait_for(lambda: stack.mode() == "fault", "the controller in fault")
    assert state.reason in (stack.status().fault or "")
    refusal = stack.refused_goal()
    assert (refusal.code, state.reason in refusal.message) == ("fault", True)
    stands = stack.state().positions
    recovered = stack.bus.ask(topics.RECOVER, m.Empty())
    assert recovered.condition == "ready"
    assert recovered.run > run
    wait_for(lambda: stack.mode() == "holding", "the controller to hold")
    state = stack.state()
    assert (state.run, state.condition, state.brake) == (recovered.run, "ready", False)
    assert state.positions == pytest.approx(stands, abs=1e-3)
    assert stack.finish(stack.goal()).outcome == "succeeded"


def test_there_is_one_robot_side(robot: str, stack: Stack):
    """A second instance ends with status 3."""
    second = subprocess.run([*COMMANDS[robot], "--listen", stack.endpoint], capture_output=True, text=True, check=False)
    assert second.returncode == Outcome.TAKEN, second.stderr
    assert "Traceback" not in second.stderr
