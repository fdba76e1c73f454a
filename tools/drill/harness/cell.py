"""A robot cell that runs: what a scenario asks and sees of it."""

import signal
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from queue import Empty, SimpleQueue

from deploy.demonstrations.make_forehand import HIT, HIT_VELOCITIES
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig
from services.common.supervisor import Supervisor

PATIENCE_S = 20.0
LATE_TRIES = 3
LOG_TIME = "%Y-%m-%d %H:%M:%S,%f"


class Broken(Exception):
    """A scenario could not be carried through."""


def code_of(ask: Callable[[], object]) -> str:
    """Return the code with which a request is refused, `taken` where it is not."""
    try:
        ask()
    except Refusal as refusal:
        return refusal.code
    return "taken"


def wait_for(condition: Callable[[], object], what: str, patience: float = PATIENCE_S) -> float:
    """Wait until `condition` holds and return how long that took, s.

    Raises:
        Broken: it did not within `patience` s.
    """
    began = time.monotonic()
    while not condition():
        if time.monotonic() - began > patience:
            raise Broken(f"waited {patience:g} s in vain for {what}")
        time.sleep(0.002)
    return time.monotonic() - began


class Cell:
    """Running services, each with its log in `folder`, and a client's bus to them."""

    def __init__(
        self, services: Supervisor, bus: Bus, endpoint: str, folder: Path, config: RobotConfig, stepped: bool
    ) -> None:
        self.services = services
        self.bus = bus
        self.endpoint = endpoint
        self.folder = folder
        self.stepped = stepped
        self.config = config
        self.home = config.home.tolist()
        self.run = 0
        self.tick = 0
        self._bodies: dict[str, SimpleQueue[bytes]] = {}
        self._state_bodies: list[bytes] = []
        self._states: list[m.State] = []
        self._commands: list[m.Command] = []

    # --- requests -------------------------------------------------------------------------------------

    def reset(self, positions: list[float] | None = None, seed: int | None = None, ball: m.Ball | None = None) -> None:
        """Begin a run with the arm at rest at `positions`, home by default; the seed tells it from those before."""
        for topic in (topics.STATE, topics.COMMAND, topics.PLAN, topics.ENDED):
            self.listen(topic)
        self.states()
        self.commands()
        self.run = self.run + 1 if seed is None else seed
        self.tick = 0
        self._state_bodies, self._states, self._commands = [], [], []
        self.bus.ask(topics.SIM_RESET, m.Reset(positions=positions, seed=self.run, ball=ball))

    def step(self, ticks: int) -> None:
        """Advance the stepped clock."""
        self.tick = self.bus.ask(topics.SIM_STEP, m.Step(ticks=ticks)).tick

    def step_to(self, tick: int) -> None:
        """Advance the stepped clock to `tick`."""
        if tick > self.tick:
            self.step(tick - self.tick)

    def goal(self, **fields: object) -> m.GoalReply:
        """Ask for a goal of the forehand, home by default; in real time once more where the plan came late."""
        goal = m.Goal(**{"primitive": "forehand", "positions": self.home, **fields})  # type: ignore[arg-type]
        for _ in range(0 if self.stepped else LATE_TRIES):
            try:
                return self.bus.ask(topics.GOAL, goal)
            except Refusal as refusal:
                if refusal.code != "late":
                    raise
        return self.bus.ask(topics.GOAL, goal)

    def under_way(self) -> m.GoalReply:
        """Ask for a motion of 2 s in real time, and return once the arm is in the middle of it."""
        reply = self.goal(positions=[0.5, *self.home[1:]], duration=2.0)
        wait_for(lambda: self.state().time > reply.start_time + 0.7, "the motion to be under way")
        return reply

    def strike(self, **fields: object) -> m.GoalReply:
        """Ask for the demonstrated strike."""
        return self.goal(**{"positions": list(HIT), "velocities": list(HIT_VELOCITIES), **fields})

    def result(self, goal_id: str) -> m.Result:
        """Ask how a goal went so far."""
        return self.bus.ask(topics.RESULT, m.ResultRequest(goal_id=goal_id))

    def state(self) -> m.State:
        """Ask for the newest state."""
        return self.bus.ask(topics.STATE_QUERY, m.Empty())

    def status(self) -> m.Status:
        """Ask for the newest status."""
        return self.bus.ask(topics.STATUS_QUERY, m.Empty())

    def mode(self) -> str:
        """Return the controller's mode, empty while it does not answer."""
        try:
            return self.bus.ask(topics.STATUS_QUERY, m.Empty(), timeout=1.0).mode
        except (Refusal, NoAnswer):
            return ""

    def lose(self, stream: str, ticks: int) -> None:
        """Lose the messages of the coming `ticks` on a stream."""
        self.bus.ask(topics.SIM_DISTURB, m.Disturb(kind="loss", stream=stream, duration=ticks * self.config.tick))  # type: ignore[arg-type]

    def finish(self, reply: m.GoalReply) -> m.Result:
        """Let the goal's motion end, and return its result."""
        if self.stepped:
            self.step_to(self.end_tick(reply) + 2)
        else:
            wait_for(lambda: self.result(reply.goal_id).outcome != "running", "the goal to end")
        return self.result(reply.goal_id)

    def end_tick(self, reply: m.GoalReply) -> int:
        """Return the tick at which the goal's motion is at rest."""
        return self.ticks(reply.start_time + reply.total_duration)

    def ticks(self, seconds: float) -> int:
        """Return a time in ticks."""
        return round(seconds * self.config.rate_hz)

    def recover(self) -> None:
        """Leave any fault: a machine that stalls may bring the arm to brake at any time."""

        def healthy() -> bool:
            try:
                self.bus.ask(topics.RESET, m.Empty())
            except (Refusal, NoAnswer):
                return False
            return not self.state().brake

        wait_for(healthy, "the fault to be reset")

    # --- processes ------------------------------------------------------------------------------------

    def signal(self, name: str, number: signal.Signals) -> float:
        """Send a signal to a process and return the Unix time of it, s."""
        sent = time.time()
        self.services.running[name].send_signal(number)
        if number == signal.SIGKILL:
            self.services.running[name].wait()
        return sent

    def restart(self, name: str) -> None:
        """Start a process anew; who stopped it, and did not end it, has to."""
        self.services.start(name)

    def memory(self) -> dict[str, float]:
        """Return the resident memory of each process, MB."""

        def resident(pid: int) -> float:
            lines = Path(f"/proc/{pid}/status").read_text().splitlines()
            return next(int(line.split()[1]) / 1e3 for line in lines if line.startswith("VmRSS"))

        return {name: resident(process.pid) for name, process in self.services.running.items()}

    def log(self, name: str) -> str:
        """Return what a process has logged."""
        return (self.folder / f"{name}.log").read_text(errors="replace")

    def said_at(self, name: str, words: str, after: float) -> float | None:
        """Return when, in Unix s, a process first logged `words` at or after `after`, or None."""
        for line in self.log(name).splitlines():
            try:
                at = datetime.strptime(line[:23], LOG_TIME).timestamp()
            except ValueError:
                continue
            if words in line and at >= after - 1e-3:
                return at
        return None

    # --- what was published ---------------------------------------------------------------------------

    def listen(self, topic: topics.Publication) -> SimpleQueue[bytes]:
        """Return the queue of all bodies published on `topic` since the first call."""
        if topic.key not in self._bodies:
            self._bodies[topic.key] = SimpleQueue()
            self.bus.listen(topic, self._bodies[topic.key].put)
        return self._bodies[topic.key]

    def plan_of(self, reply: m.GoalReply) -> m.Plan:
        """Return the plan that was published for a goal of this run."""
        while (plan := decode(self._next(topics.PLAN), m.Plan, 1 << 24)).goal_id != reply.goal_id:
            pass
        return plan

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

    def drain(self, topic: topics.Publication[topics.MessageT]) -> list[topics.MessageT]:
        """Return every message on `topic` since the last call; those before the first `listen` are lost."""
        queue = self.listen(topic)
        return [decode(queue.get(), topic.message, 1 << 24) for _ in range(queue.qsize())]

    def _next(self, topic: topics.Publication) -> bytes:
        try:
            return self.listen(topic).get(timeout=PATIENCE_S)
        except Empty:
            raise Broken(f"nothing was published on {topic.key} within {PATIENCE_S:g} s") from None


def _read(body: bytes, kind: type[topics.MessageT]) -> topics.MessageT | None:
    """Return the message in a body, None where a scenario has sent noise."""
    try:
        return decode(body, kind)
    except Refusal:
        return None
