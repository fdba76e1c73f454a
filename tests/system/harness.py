"""Real processes on a bus of their own, and what a test wants to ask and see of them."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Empty, SimpleQueue

import numpy as np
import pytest

from motion.samples import Samples
from protocol import messages as m
from protocol import topics
from protocol.bus import Bus, open_session
from protocol.codec import decode, matrix
from protocol.errors import Refusal
from services.options import Options, free_endpoint
from services.robot import load_robot
from services.supervisor import Supervisor, command_lines

ROBOT = load_robot()
SERVICES = ("sim", "planner", "controller")
PATIENCE_S = 20.0


def wait_for(condition: Callable[[], object], what: str, patience: float = PATIENCE_S) -> None:
    """Return once `condition` holds; fail after `patience` s, saying what was waited for."""
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline, f"waited {patience} s in vain: {what}"
        time.sleep(0.01)


class Stack:
    """Running services and a client's bus to them."""

    def __init__(self, services: Supervisor, bus: Bus, endpoint: str, library: Path) -> None:
        self.services = services
        self.bus = bus
        self.endpoint = endpoint
        self.library = library
        self.run = 0
        self.tick = 0
        self._bodies: dict[str, SimpleQueue[bytes]] = {}
        self._state_bodies: list[bytes] = []
        self._states: list[m.State] = []
        self._commands: list[m.Command] = []

    # --- requests -------------------------------------------------------------------------------------

    def reset(self, positions: list[float] | None = None, seed: int | None = None) -> None:
        """Begin a run with the arm at rest at `positions`, home by default; the seed tells it from those before."""
        for topic in (topics.STATE, topics.COMMAND, topics.PLAN, topics.ENDED):
            self.listen(topic)
        if seed == self.run:  # what is still under way must not be taken for the new run
            self.states()
            self.commands()
        self.run = self.run + 1 if seed is None else seed
        self.tick = 0
        self._state_bodies, self._states, self._commands = [], [], []
        self.bus.ask(topics.SIM_RESET, m.Reset(positions=positions, seed=self.run))

    def step(self, ticks: int) -> None:
        """Advance the stepped clock."""
        self.tick = self.bus.ask(topics.SIM_STEP, m.Step(ticks=ticks)).tick

    def step_to(self, tick: int) -> None:
        """Advance the stepped clock to `tick`."""
        if tick > self.tick:
            self.step(tick - self.tick)

    def goal(self, **fields: object) -> m.GoalReply:
        """Ask for a goal."""
        return self.bus.ask(topics.GOAL, m.Goal(**fields))  # type: ignore[arg-type]

    def refused_goal(self, **fields: object) -> Refusal:
        """Ask for a goal that must be refused, and return the refusal."""
        with pytest.raises(Refusal) as caught:
            self.goal(**fields)
        return caught.value

    def result(self, goal_id: str) -> m.Result:
        """Ask how a goal went so far."""
        return self.bus.ask(topics.RESULT, m.ResultRequest(goal_id=goal_id))

    def cancel(self, goal_id: str | None = None) -> m.Canceled:
        """Stop the motion."""
        return self.bus.ask(topics.CANCEL, m.Cancel(goal_id=goal_id))

    def state(self) -> m.State:
        """Ask for the newest state."""
        return self.bus.ask(topics.STATE_QUERY, m.Empty())

    def status(self) -> m.Status:
        """Ask for the newest status."""
        return self.bus.ask(topics.STATUS_QUERY, m.Empty())

    def finish(self, reply: m.GoalReply) -> m.Result:
        """Step until the goal's motion is over and return its result."""
        self.step_to(end_tick(reply) + 2)
        return self.result(reply.goal_id)

    # --- what was published ---------------------------------------------------------------------------

    def listen(self, topic: topics.Publication) -> SimpleQueue[bytes]:
        """Return the queue of all bodies published on `topic` since the first call."""
        if topic.key not in self._bodies:
            self._bodies[topic.key] = SimpleQueue()
            self.bus.listen(topic, self._bodies[topic.key].put)
        return self._bodies[topic.key]

    def next(self, topic: topics.Publication[topics.Said], timeout: float = PATIENCE_S) -> topics.Said:
        """Wait for the next message on `topic`; the first call must come before it is published."""
        try:
            return decode(self.listen(topic).get(timeout=timeout), topic.message, 1 << 24)
        except Empty:
            raise AssertionError(f"nothing was published on {topic.key} within {timeout} s") from None

    def plan_of(self, reply: m.GoalReply) -> m.Plan:
        """Return the plan that was published for a goal of this run."""
        while (plan := self.next(topics.PLAN)).goal_id != reply.goal_id:
            pass
        return plan

    def states(self) -> list[m.State]:
        """Return every state of this run up to the present tick."""
        while not self._states or self._states[-1].tick < self.tick:
            body = self.listen(topics.STATE).get(timeout=PATIENCE_S)
            state = decode(body, m.State)
            if state.run == self.run:
                self._states.append(state)
                self._state_bodies.append(body)
        return self._states

    def state_bodies(self) -> list[bytes]:
        """Return the bytes of every state of this run up to the present tick."""
        self.states()
        return self._state_bodies

    def commands(self) -> list[m.Command]:
        """Return every command of this run up to the present tick."""
        while not self._commands or self._commands[-1].tick < self.tick:
            command = decode(self.listen(topics.COMMAND).get(timeout=PATIENCE_S), m.Command)
            if command.run == self.run:
                self._commands.append(command)
        return self._commands


def end_tick(reply: m.GoalReply) -> int:
    """Return the tick at which the goal's motion is at rest."""
    return round((reply.start_time + reply.total_duration) * 1000)


@contextmanager
def running(
    tmp_path: Path, names: tuple[str, ...] = SERVICES, clock: str = "stepped", **flags: object
) -> Iterator[Stack]:
    """Run the named services until the block ends, then check that each ended with status 0."""
    endpoint, library = free_endpoint(), tmp_path / "library"
    values: dict[str, object] = {"clock": clock, "library": library, **flags}
    lines = command_lines(Options(listen=(endpoint,)), values)
    supervisor = Supervisor({name: lines[name] for name in lines if name in names})
    with supervisor, Bus(open_session([endpoint])) as bus:
        supervisor.wait_ready(bus)
        stack = Stack(supervisor, bus, endpoint, library)
        if {"sim", "controller"} <= set(names):
            wait_for_controller(stack)
        yield stack
        processes = dict(supervisor.running)
    statuses = {name: process.returncode for name, process in processes.items()}
    assert statuses == dict.fromkeys(processes, 0), statuses


def wait_for_controller(stack: Stack) -> None:
    """Return once the controller has heard of the arm."""

    def awake() -> bool:
        try:
            return bool(stack.status())
        except Refusal:
            return False

    wait_for(awake, "the controller to hear of the arm")


class Reference:
    """What the controller commanded over a run: positions and velocities (ticks, J), and their mean accelerations."""

    def __init__(self, commands: list[m.Command]) -> None:
        self.positions = np.array([command.positions for command in commands])
        self.velocities = np.array([command.velocities for command in commands])
        self.accelerations = np.diff(self.velocities, axis=0) * ROBOT.rate_hz
        ticks = [command.tick for command in commands]
        assert ticks == list(range(len(ticks))), "every tick has one command"

    def check_smooth(self) -> None:
        """Positions follow velocities, and no acceleration steps by more than the jerk allows in a tick."""
        jerks, tick = ROBOT.limits.jerks, ROBOT.tick
        means = (self.velocities[1:] + self.velocities[:-1]) / 2
        assert np.all(np.abs(np.diff(self.positions, axis=0) - means * tick) <= jerks * tick**3 / 6 + 1e-9)
        assert np.all(np.abs(np.diff(self.accelerations, axis=0)) <= jerks * tick * (1 + 1e-3))

    def check_limits(self) -> None:
        """Position, velocity and acceleration stay inside the robot's limits."""
        limits = ROBOT.limits
        assert np.all(self.positions >= limits.positions[:, 0] - 1e-6)
        assert np.all(self.positions <= limits.positions[:, 1] + 1e-6)
        assert np.all(np.abs(self.velocities) <= limits.velocities * (1 + 1e-6))
        assert np.all(np.abs(self.accelerations) <= limits.accelerations * (1 + 1e-6))


def samples_of(trajectory: m.Trajectory | m.Plan) -> Samples:
    """Return the samples of a trajectory on the wire."""
    shape = trajectory.count, len(trajectory.joint_names)
    return Samples(*(matrix(getattr(trajectory, f), *shape, f) for f in ("positions", "velocities", "accelerations")))
