"""A running robot cell: what a scenario asks of it."""

from collections.abc import Callable
from pathlib import Path

from deploy.demonstrations.make_forehand import HIT, HIT_VELOCITIES
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig
from services.common.supervisor import Supervisor
from tools.drill.harness.observer import Observer
from tools.drill.harness.processes import Processes
from tools.drill.harness.waiting import wait_for

LATE_TRIES = 3
ACCEPTED = "accepted"


def code_of(ask: Callable[[], object]) -> str:
    """Return the code with which a request is refused, `accepted` where it is not."""
    try:
        ask()
    except Refusal as refusal:
        return refusal.code
    return ACCEPTED


class Cell(Observer):
    """Running services, and a client's bus to them.

    Attributes:
        services: The supervisor of its processes.
        processes: Signals, logs and memory of its processes.
        endpoint: Where its router listens.
        folder: Of its logs and its library.
        stepped: Its clock is the stepped one.
        config: The robot's description.
        home: The robot's home, rad.
    """

    def __init__(
        self, services: Supervisor, bus: Bus, endpoint: str, folder: Path, config: RobotConfig, stepped: bool
    ) -> None:
        super().__init__(bus)
        self.services = services
        self.processes = Processes(services, folder)
        self.endpoint = endpoint
        self.folder = folder
        self.stepped = stepped
        self.config = config
        self.home = config.home.tolist()

    # --- the clock ------------------------------------------------------------------------------------

    def reset(self, positions: list[float] | None = None, seed: int | None = None, ball: m.Ball | None = None) -> None:
        """Begin a run, numbered `seed` or by the next number, with the arm at rest at `positions` or at home."""
        self.begin_run(self.run + 1 if seed is None else seed)
        self.bus.ask(topics.SIM_RESET, m.Reset(positions=positions, seed=self.run, ball=ball))

    def step(self, ticks: int) -> None:
        """Advance the stepped clock."""
        self.tick = self.bus.ask(topics.SIM_STEP, m.Step(ticks=ticks)).tick

    def step_to(self, tick: int) -> None:
        """Advance the stepped clock to `tick`."""
        if tick > self.tick:
            self.step(tick - self.tick)

    def pass_time(self, seconds: float) -> None:
        """Wait until `seconds` of robot time have passed in real time; a busy machine takes longer."""
        end = self.state().time + seconds
        wait_for(lambda: self.state().time >= end, f"{seconds:g} s of robot time")

    def ticks(self, seconds: float) -> int:
        """Return a time in ticks."""
        return round(seconds * self.config.rate_hz)

    # --- motions --------------------------------------------------------------------------------------

    def goal(self, **fields: object) -> m.GoalReply:
        """Ask for a goal of the forehand, home by default; in real time again where the plan came late."""
        goal = m.Goal(**{"primitive": "forehand", "positions": self.home, **fields})  # type: ignore[arg-type]
        for _ in range(0 if self.stepped else LATE_TRIES):
            try:
                return self.bus.ask(topics.GOAL, goal)
            except Refusal as refusal:
                if refusal.code != "late":
                    raise
        return self.bus.ask(topics.GOAL, goal)

    def strike(self, **fields: object) -> m.GoalReply:
        """Ask for the demonstrated strike."""
        return self.goal(**{"positions": list(HIT), "velocities": list(HIT_VELOCITIES), **fields})

    def move_aside(self, duration: float) -> m.GoalReply:
        """Ask for a motion of joint_1 to 0.5 rad."""
        return self.goal(positions=[0.5, *self.home[1:]], duration=duration)

    def under_way(self) -> m.GoalReply:
        """Ask for a motion of 2 s in real time, and return once the arm is in the middle of it."""
        reply = self.move_aside(2.0)
        wait_for(lambda: self.state().time > reply.start_time + 0.7, "the motion to be under way")
        return reply

    def end_tick(self, reply: m.GoalReply) -> int:
        """Return the tick at which the goal's motion is at rest."""
        return self.ticks(reply.start_time + reply.total_duration)

    def finish(self, reply: m.GoalReply) -> m.Result:
        """Let the goal's motion end, and return its result."""
        if self.stepped:
            self.step_to(self.end_tick(reply) + 2)
        else:
            self.wait_ended(reply.goal_id)
        return self.result(reply.goal_id)

    def wait_ended(self, goal_id: str) -> None:
        """Wait in real time until a goal's motion has ended."""
        wait_for(lambda: self.result(goal_id).outcome != "running", "the motion to end")

    # --- questions ------------------------------------------------------------------------------------

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

    def library(self) -> list[m.PrimitiveEntry]:
        """Return the planner's library, empty while it does not answer."""
        try:
            return self.bus.ask(topics.PRIMITIVES, m.Empty(), timeout=1.0).primitives
        except (NoAnswer, Refusal):
            return []

    # --- faults ---------------------------------------------------------------------------------------

    def lose(self, stream: str, ticks: int) -> None:
        """Lose the messages of the coming `ticks` on a stream."""
        self.bus.ask(topics.SIM_DISTURB, m.Disturb(kind="loss", stream=stream, duration=ticks * self.config.tick))  # type: ignore[arg-type]

    def recover(self) -> None:
        """Leave any fault; in real time a machine that stalls may make the arm brake at any time."""

        def healthy() -> bool:
            try:
                self.bus.ask(topics.RESET, m.Empty())
            except (Refusal, NoAnswer):
                return False
            return not self.state().brake

        wait_for(healthy, "the fault to be reset")
