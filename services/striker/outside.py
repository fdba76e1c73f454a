"""The interface between the striker and its environment."""

from dataclasses import dataclass
from typing import Protocol

from protocol import messages as m
from protocol.errors import NoAnswer, Refusal


@dataclass(frozen=True, slots=True)
class Taken:
    """A goal that is played: begin and end, in robot time (s)."""

    goal_id: str
    start_time: float
    rest_time: float


Reply = Taken | Refusal | NoAnswer
"""What comes of a goal."""


class Outside(Protocol):
    """Goals, commands and publications of the striker."""

    def ask(self, goal: m.Goal) -> None:
        """Send a goal; `Striker.answered` receives its reply."""
        ...

    def command(self) -> m.Command | None:
        """Return the controller's newest command, None if none has arrived since the last call."""
        ...

    def say(self, strike: m.Strike) -> None:
        """Publish a decision."""
        ...
