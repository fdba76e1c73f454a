"""The publications of a robot cell, kept for the present run."""

from collections.abc import Callable
from queue import Empty, SimpleQueue

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import Refusal
from tools.drill.harness.waiting import PATIENCE_S, ScenarioError, wait_for

MAX_BYTES = 1 << 24


class Observer:
    """Subscribes to a cell's publications, and keeps the states and commands of the present run.

    Attributes:
        run: Number of the present run; 0 before the first.
        tick: Present tick of the stepped clock.
    """

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.run = 0
        self.tick = 0
        self._bodies: dict[str, SimpleQueue[bytes]] = {}
        self._state_bodies: list[bytes] = []
        self._states: list[m.State] = []
        self._commands: list[m.Command] = []

    def begin_run(self, run: int) -> None:
        """Discard the present run and observe run number `run`."""
        for topic in (topics.STATE, topics.COMMAND, topics.PLAN, topics.ENDED):
            self.listen(topic)
        self.states()
        self.commands()
        self.run, self.tick = run, 0
        self._state_bodies, self._states, self._commands = [], [], []

    def listen(self, topic: topics.Publication) -> SimpleQueue[bytes]:
        """Return the queue of all bodies published on `topic` since the first call."""
        if topic.key not in self._bodies:
            self._bodies[topic.key] = SimpleQueue()
            self.bus.listen(topic, self._bodies[topic.key].put)
        return self._bodies[topic.key]

    def drain(self, topic: topics.Publication[topics.MessageT]) -> list[topics.MessageT]:
        """Return the messages on `topic` since the last call, or since the first `listen`."""
        queue = self.listen(topic)
        return [decode(queue.get(), topic.message, MAX_BYTES) for _ in range(queue.qsize())]

    def plan_of(self, reply: m.GoalReply) -> m.Plan:
        """Return the plan that was published for a goal of this run."""
        while (plan := decode(self._next(topics.PLAN), m.Plan, MAX_BYTES)).goal_id != reply.goal_id:
            pass
        return plan

    def wait_status(self, condition: Callable[[m.Status], object], what: str, patience: float = PATIENCE_S) -> float:
        """Wait until the controller publishes a status for which `condition` holds; return the waiting time, s.

        Each status since the first `listen` is checked once, in order, because a mode may last only a few ticks, which
        queries would miss.

        Raises:
            ScenarioError: no such status was published within `patience` s.
        """
        statuses = self.listen(topics.STATUS)

        def published() -> bool:
            return any(condition(decode(statuses.get(), m.Status, MAX_BYTES)) for _ in range(statuses.qsize()))

        return wait_for(published, what, patience)

    def states(self) -> list[m.State]:
        """Return every state of this run up to the present tick."""
        while self.run and (not self._states or self._states[-1].tick < self.tick):
            body = self._next(topics.STATE)
            state = _read(body, m.State)
            if state is not None and state.run == self.run:
                self._states.append(state)
                self._state_bodies.append(body)
        return self._states

    def state_bodies(self) -> list[bytes]:
        """Return the bytes of every state of this run up to the present tick."""
        self.states()
        return self._state_bodies

    def commands(self) -> list[m.Command]:
        """Return every command of this run up to the present tick."""
        while self.run and (not self._commands or self._commands[-1].tick < self.tick):
            command = _read(self._next(topics.COMMAND), m.Command)
            if command is not None and (command.run, command.source) == (self.run, "controller"):
                self._commands.append(command)
        return self._commands

    def _next(self, topic: topics.Publication) -> bytes:
        try:
            return self.listen(topic).get(timeout=PATIENCE_S)
        except Empty:
            raise ScenarioError(f"nothing was published on {topic.key} within {PATIENCE_S:g} s") from None


def _read(body: bytes, kind: type[topics.MessageT]) -> topics.MessageT | None:
    """Decode a message; return None for noise that a scenario has sent."""
    try:
        return decode(body, kind)
    except Refusal:
        return None
