"""Real processes on a router of their own, with the requests and observations that tests need.

`Stack` is the drill's cell. The log lines of services are printed, so that pytest shows them after a failure.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Empty

import numpy as np
import pytest

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import SERVICE, open_session
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from robot.description import load_robot
from services.common.cli import Options
from services.common.logs import LogForm
from tests.cores import LOOP_CORE
from tools.drill.harness import commanded
from tools.drill.harness.cell import Cell
from tools.drill.harness.start import ARM as SERVICES
from tools.drill.harness.start import CellConfig, start_cell
from tools.drill.harness.waiting import PATIENCE_S, wait_for

ROBOT = load_robot()


class Stack(Cell):
    """The drill's cell, with the requests that only tests make."""

    def refused_goal(self, **fields: object) -> Refusal:
        """Ask for a goal that must be refused, and return the refusal."""
        with pytest.raises(Refusal) as caught:
            self.goal(**fields)
        return caught.value

    def kill(self, name: str) -> None:
        """Kill a process and wait until its liveliness token is gone.

        Otherwise its successor would count as ready too early.
        """
        self.processes.signal(name, signal.SIGKILL)
        wait_for(lambda: not self.bus.is_alive(name), f"the token of the {name} to vanish")

    def start_again(self, *names: str) -> None:
        """Start processes in place of those that ended, and wait until all are ready and the arm is detected."""
        for name in names:
            self.services.start(name)
        self.services.wait_ready(self.bus)
        wait_for_controller(self)

    def answers(self) -> bool:
        """Return whether planner, controller and sim each answer a request that reads."""
        try:
            return bool(self.state() and self.status() and self.bus.ask(topics.PRIMITIVES, m.Empty()))
        except NoAnswer:
            return False

    def cancel(self, goal_id: str | None = None) -> m.Canceled:
        """Stop the motion."""
        return self.bus.ask(topics.CANCEL, m.Cancel(goal_id=goal_id))

    def next(self, topic: topics.Publication[topics.MessageT], timeout: float = PATIENCE_S) -> topics.MessageT:
        """Wait for the next message on `topic`; the first call must come before it is published."""
        try:
            return decode(self.listen(topic).get(timeout=timeout), topic.message, 1 << 24)
        except Empty:
            raise AssertionError(f"nothing was published on {topic.key} within {timeout} s") from None


@contextmanager
def running(
    tmp_path: Path,
    names: tuple[str, ...] = SERVICES,
    clock: m.Clock = "stepped",
    log: LogForm = "text",
    **flags: object,
) -> Iterator[Stack]:
    """Run the named services until the block ends, then check that each ended with status 0."""
    config = CellConfig(clock=clock, services=names, flags=flags)
    try:
        with start_cell(config, Options(log=log, loop_core=LOOP_CORE), tmp_path, Stack) as stack:
            yield stack
            processes = dict(stack.services.running)
    finally:
        for file in sorted(tmp_path.glob("*.log")):
            print(f"--- {file.name}\n{file.read_text(errors='replace')}")
    statuses = {name: process.returncode for name, process in processes.items()}
    assert statuses == dict.fromkeys(processes, 0), statuses


def joined(endpoint: str) -> Bus:
    """Join a bus with the session timeouts of a service, so that a stall of this process does not end the session."""
    return Bus(open_session([endpoint], timeouts=SERVICE))


def wait_for_controller(stack: Stack) -> None:
    """Wait until the controller has detected the arm."""
    wait_for(stack.mode, "the controller to detect the arm")


class Reference(commanded.CommandedMotion):
    """What the controller commanded over a run, tick by tick."""

    def __init__(self, commands: list[m.Command]) -> None:
        super().__init__(commands, ROBOT)
        ticks = [command.tick for command in commands]
        assert ticks == list(range(len(ticks))), "every tick has one command"

    def check_smooth(self) -> None:
        """Check that positions are the integral of velocities, and that accelerations change within the jerk limit."""
        jerks, tick = ROBOT.limits.jerks, ROBOT.tick
        means = (self.velocities[1:] + self.velocities[:-1]) / 2
        assert np.all(np.abs(np.diff(self.positions, axis=0) - means * tick) <= jerks * tick**3 / 6 + 1e-9)
        assert np.all(np.abs(np.diff(self.accelerations, axis=0)) <= jerks * tick * (1 + 1e-3))

    def check_limits(self) -> None:
        """Check that position, velocity and acceleration stay inside the robot's limits."""
        limits = ROBOT.limits
        assert np.all(self.positions >= limits.positions[:, 0] - 1e-6)
        assert np.all(self.positions <= limits.positions[:, 1] + 1e-6)
        assert np.all(np.abs(self.velocities) <= limits.velocities * (1 + 1e-6))
        assert np.all(np.abs(self.accelerations) <= limits.accelerations * (1 + 1e-6))


def check_end(stack: Stack, reply: m.GoalReply) -> None:
    """Check that the motion is played smoothly, inside the limits, to the end that the reply names."""
    assert stack.finish(reply).outcome == "succeeded"
    played = Reference(stack.commands())
    played.check_smooth()
    played.check_limits()
    at = stack.ticks(reply.start_time + reply.duration)
    assert np.abs(played.positions[at] - reply.positions).max() < 1e-9
    assert np.abs(played.velocities[at] - reply.velocities).max() < 1e-8
