"""What the striker needs from its environment: goals, commands, publications."""

from dataclasses import dataclass
from typing import Protocol

from protocol import messages as m
from protocol.errors import NoAnswer, Refusal


@dataclass(frozen=True, slots=True)
class AcceptedGoal:
    """A goal that is played: begin and end, in robot time (s)."""

    goal_id: str
    start_time: float
    rest_time: float


Reply = AcceptedGoal | Refusal | NoAnswer
"""The reply to a goal."""


class StrikerLink(Protocol):
    """Connects the striker to planner, controller and subscribers."""

    def send_goal(self, goal: m.Goal) -> None:
        """Send a goal; `Striker.handle_reply` receives its reply."""
        ...

    def newest_command(self) -> m.Command | None:
        """Return the controller's newest command, None if none has arrived since the last call."""
        ...

    def publish(self, strike: m.Strike) -> None:
        """Publish a decision."""
        ...
