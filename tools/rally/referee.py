"""Counts the strokes of two arms that play one ball, from contacts and sights alone."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

from protocol.messages import BallState, Contact
from robot.court import BALL
from robot.description import RobotConfig
from robot.striking.scoring import place_at

SAME_STROKE_S = 0.15
"""Contacts of an arm that follow each other so soon are one stroke."""
LIES_S = 2.5
"""A ball that nobody touched for so long, and that met no court, lies."""
SIGHTS = 16


@dataclass(frozen=True, slots=True)
class Touch:
    """The ball met an arm, or the court: when (s), and which arm, "" for the court."""

    time: float
    arm: str


class Referee:
    """Follows one rally.

    A stroke counts once the ball has come down in the court's region of the arm that struck, or the other arm has
    taken it before.

    Attributes:
        strokes: Strokes that count.
        over: Why the rally has ended; empty while it goes on.
    """

    def __init__(self, arms: Mapping[str, RobotConfig], receiver: str, served: float) -> None:
        """`arms`: both, by name; `receiver`: who is to strike first; `served`: when (s) the ball was thrown."""
        self._arms = arms
        self._turn = receiver
        self._bounced = False
        self._struck: str | None = None
        self._last = Touch(served, "")
        self._sights: deque[BallState] = deque(maxlen=SIGHTS)
        self.strokes = 0
        self.over = ""

    def see(self, sight: BallState) -> None:
        """Take in where the ball was seen."""
        self._sights.append(sight)
        if sight.time > self._last.time + LIES_S:
            self._end(f"{self._turn} did not play the ball")

    def touch(self, contact: Contact) -> None:
        """Take in a contact; those without the ball, before the serve and at their end say nothing."""
        if BALL not in contact.bodies or contact.ended or contact.time < self._last.time or self.over:
            return
        names = set(contact.bodies)
        for name, config in self._arms.items():
            if names & config.bodies:
                self._strike(contact.time, name)
            elif name == self._turn and config.court and config.court.surface in names:
                self._bounce(contact.time)

    def _strike(self, time: float, arm: str) -> None:
        again = arm == self._last.arm and time < self._last.time + SAME_STROKE_S
        self._last = Touch(time, arm)
        if again:
            return
        if arm != self._turn:
            self._end(f"{arm} touched the ball twice")
            return
        if self._struck is not None and not self._bounced:
            self.strokes += 1
        self._struck, self._turn, self._bounced = arm, self._other(arm), False

    def _bounce(self, time: float) -> None:
        self._last = Touch(time, "")
        if self._bounced:
            self._end(f"it bounced twice before {self._turn}")
            return
        self._bounced = True
        striker = self._struck or self._other(self._turn)
        court, place = self._arms[striker].court, place_at(self._sights, time)
        assert court is not None
        if place is not None and not all(low <= place[i] <= high for i, (low, high) in enumerate(court.region)):
            self._end(f"{striker}'s ball was out at {place[0]:.2f}, {place[1]:.2f} m")
        elif self._struck is not None:
            self.strokes += 1

    def _other(self, arm: str) -> str:
        return next(name for name in self._arms if name != arm)

    def _end(self, reason: str) -> None:
        self.over = self.over or reason
