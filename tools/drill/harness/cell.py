"""A running robot cell, with the requests that scenarios send."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

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

AnswerT = TypeVar("AnswerT")
LATE_TRIES = 3
ACCEPTED = "accepted"


def answer_or(otherwise: AnswerT, send: Callable[[], AnswerT]) -> AnswerT:
    """Send a request, and return what it returns, or `otherwise` if it is refused or not answered."""
    try:
        return send()
    except (Refusal, NoAnswer):
        return otherwise


def refusal_code(send: Callable[[], object]) -> str:
    """Send a request, and return the code of its refusal, or `accepted`."""
    try:
        send()
    except Refusal as refusal:
        return refusal.code
    return ACCEPTED


class Cell(Observer):
    """Running services of one robot, and a client's connection to them.

    Attributes:
        services: Supervisor of the processes.
        processes: Signals, logs and memory of the processes.
        endpoint: Endpoint of the router.
        folder: Directory of the logs and the library.
        stepped: Whether the clock is the stepped one.
        config: Description of the robot.
        home: Home position of the joints, rad.
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
        """Begin run number `seed`, by default the next one, with the arm at rest at `positions`, by default at home."""
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
        """Wait until `seconds` of robot time have passed, which takes longer on a busy machine."""
        end = self.state().time + seconds
        wait_for(lambda: self.state().time >= end, f"{seconds:g} s of robot time")

    def ticks(self, seconds: float) -> int:
        """Convert a time from s to ticks."""
        return round(seconds * self.config.rate_hz)

    # --- motions --------------------------------------------------------------------------------------

    def goal(self, **fields: object) -> m.GoalReply:
        """Send a goal of the forehand, by default to home. In real time, send it again if its plan was late."""
        goal = m.Goal(**{"primitive": "forehand", "positions": self.home, **fields})  # type: ignore[arg-type]
        for _ in range(0 if self.stepped else LATE_TRIES):
            try:
                return self.bus.ask(topics.GOAL, goal)
            except Refusal as refusal:
                if refusal.code != "late":
                    raise
        return self.bus.ask(topics.GOAL, goal)

    def strike(self, **fields: object) -> m.GoalReply:
        """Send the goal of the demonstrated strike."""
        return self.goal(**{"positions": list(HIT), "velocities": list(HIT_VELOCITIES), **fields})

    def move_aside(self, duration: float) -> m.GoalReply:
        """Send a goal that moves joint_1 to 0.5 rad and the others to home."""
        return self.goal(positions=[0.5, *self.home[1:]], duration=duration)

    def begin_motion(self) -> m.GoalReply:
        """Begin a motion of 2 s in real time, and return 0.7 s after its start."""
        reply = self.move_aside(2.0)
        wait_for(lambda: self.state().time > reply.start_time + 0.7, "0.7 s of the motion")
        return reply

    def end_tick(self, reply: m.GoalReply) -> int:
        """Return the tick at which the goal's motion has come to rest."""
        return self.ticks(reply.start_time + reply.total_duration)

    def finish(self, reply: m.GoalReply) -> m.Result:
        """Wait until the goal's motion has ended, or step to its end; return its result."""
        if self.stepped:
            self.step_to(self.end_tick(reply) + 2)
        else:
            self.wait_ended(reply.goal_id)
        return self.result(reply.goal_id)

    def wait_ended(self, goal_id: str) -> None:
        """Wait in real time until a goal's motion has ended."""
        wait_for(lambda: self.result(goal_id).outcome != "running", "the motion to end")

    # --- queries --------------------------------------------------------------------------------------

    def result(self, goal_id: str) -> m.Result:
        """Query the result of a goal so far."""
        return self.bus.ask(topics.RESULT, m.ResultRequest(goal_id=goal_id))

    def state(self) -> m.State:
        """Query the newest state."""
        return self.bus.ask(topics.STATE_QUERY, m.Empty())

    def status(self) -> m.Status:
        """Query the newest status."""
        return self.bus.ask(topics.STATUS_QUERY, m.Empty())

    def mode(self) -> str:
        """Return the controller's mode, or an empty string if it does not reply."""
        return answer_or("", lambda: self.bus.ask(topics.STATUS_QUERY, m.Empty(), timeout=1.0).mode)

    def library(self) -> list[m.PrimitiveEntry]:
        """Return the planner's library, or an empty list if it does not reply."""
        return answer_or([], lambda: self.bus.ask(topics.PRIMITIVES, m.Empty(), timeout=1.0).primitives)

    # --- faults ---------------------------------------------------------------------------------------

    def drop_messages(self, stream: str, ticks: int) -> None:
        """Drop the messages of the next `ticks` on a stream."""
        self.bus.ask(topics.SIM_DISTURB, m.Disturb(kind="loss", stream=stream, duration=ticks * self.config.tick))  # type: ignore[arg-type]

    def recover(self) -> None:
        """Reset the controller until the arm does not brake; in real time a stall of the machine makes it brake."""

        def healthy() -> bool:
            return answer_or(None, lambda: self.bus.ask(topics.RESET, m.Empty())) is not None and not self.state().brake

        wait_for(healthy, "the fault to be reset")
