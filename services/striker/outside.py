"""What the striker needs from the world around it."""

from typing import Protocol

from protocol import messages as m


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
