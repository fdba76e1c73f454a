"""Real processes on a bus of their own, one set for each test."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from protocol import messages as m
from protocol import topics
from protocol.bus import Bus, open_session
from services.options import Options, free_endpoint
from services.supervisor import Supervisor, command_lines


class Stack:
    """Running services and a client's bus to them."""

    def __init__(self, services: Supervisor, bus: Bus, endpoint: str, library: Path) -> None:
        self.services = services
        self.bus = bus
        self.endpoint = endpoint
        self.library = library

    def step(self, ticks: int) -> m.Stepped:
        """Advance the stepped clock."""
        return self.bus.ask(topics.SIM_STEP, m.Step(ticks=ticks))

    def finish(self, reply: m.GoalReply) -> m.Result:
        """Step until the goal's motion is over and return its result."""
        now = self.bus.ask(topics.STATE_QUERY, m.Empty()).tick
        end = round((reply.start_time + reply.total_duration) * 1000)
        self.step(max(1, end - now + 2))
        return self.bus.ask(topics.RESULT, m.ResultRequest(goal_id=reply.goal_id))


@contextmanager
def running(
    tmp_path: Path, names: tuple[str, ...] = ("sim", "planner", "controller"), clock: str = "stepped", **flags: object
) -> Iterator[Stack]:
    """Run the named services until the block ends, then check that each ended with status 0."""
    endpoint, library = free_endpoint(), tmp_path / "library"
    values: dict[str, object] = {"clock": clock, "library": library, **flags}
    lines = command_lines(Options(listen=(endpoint,)), values)
    supervisor = Supervisor({name: lines[name] for name in lines if name in names})
    with supervisor, Bus(open_session([endpoint])) as bus:
        supervisor.wait_ready(bus)
        if {"sim", "controller"} <= set(names):
            bus.ask(topics.SIM_RESET, m.Reset())
        yield Stack(supervisor, bus, endpoint, library)
        processes = dict(supervisor.running)
    assert {name: process.returncode for name, process in processes.items()} == dict.fromkeys(processes, 0)


@pytest.fixture
def stack(tmp_path: Path) -> Iterator[Stack]:
    """Sim, planner and controller on the stepped clock."""
    with running(tmp_path) as stack:
        yield stack
