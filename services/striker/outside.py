"""What the striker needs from the world around it."""

from dataclasses import dataclass
from typing import Protocol

from protocol import messages as m
from protocol.errors import NoAnswer, Refusal


@dataclass(frozen=True, slots=True)
class Taken:
    """A goal that is played: from when, and until when, in robot time (s)."""

    goal_id: str
    start_time: float
    rest_time: float


Reply = Taken | Refusal | NoAnswer
"""What comes of a goal."""


class Outside(Protocol):
    """What the striker asks and says."""

    def ask(self, goal: m.Goal) -> None:
        """Send a goal; `Striker.answered` gets what comes of it."""
        ...

    def command(self) -> m.Command | None:
        """Return the controller's newest command, None where none came since the last call."""
        ...

    def say(self, strike: m.Strike) -> None:
        """Publish a decision."""
        ...
