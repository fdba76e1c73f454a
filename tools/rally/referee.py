"""Count the strokes of two arms that play one ball, from contacts and sights alone."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

from protocol.messages import BallState, Contact
from robot.court import BALL
from robot.description import RobotConfig
from robot.striking.scoring import place_at

SAME_STROKE_S = 0.15
"""Contacts of an arm within this time are one stroke, s."""
LYING_S = 2.5
"""A ball that has touched no arm and not bounced for this time is out of play, s."""
SIGHTS = 16
"""Number of sights that are kept, to find the place of a bounce."""


@dataclass(frozen=True, slots=True)
class Touch:
    """A contact of the ball: time, s, and name of the arm, empty for the court."""

    time: float
    arm: str


class Referee:
    """Scores one rally.

    A stroke counts when the ball has bounced in the region of the striking arm's court, or the other arm has hit it
    before.

    Attributes:
        strokes: Number of strokes that count.
        over: Why the rally has ended; empty until then.
    """

    def __init__(self, arms: Mapping[str, RobotConfig], receiver: str, served: float) -> None:
        """`arms`: both arms, by name; `receiver`: the arm that must strike first; `served`: time of the throw, s."""
        self._arms = arms
        self._turn = receiver
        self._bounced = False
        self._struck: str | None = None
        self._last = Touch(served, "")
        self._sights: deque[BallState] = deque(maxlen=SIGHTS)
        self.strokes = 0
        self.over = ""

    def add_sight(self, sight: BallState) -> None:
        """Process a sight of the ball."""
        self._sights.append(sight)
        if sight.time > self._last.time + LYING_S:
            self._end(f"{self._turn} did not play the ball")

    def add_contact(self, contact: Contact) -> None:
        """Process a contact; contacts without the ball, before the serve, and ends of contacts are ignored."""
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
