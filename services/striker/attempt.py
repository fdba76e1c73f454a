"""One ball: its sights, plans and goals, until it has landed."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from protocol import messages as m
from robot.striking.choice import Choice

Stage = Literal["seen", "swinging", "struck", "over"]
FLOWN = 0.9
"""Part of the flight to the target after which a ball is evaluated, so that spin and air count."""


@dataclass(frozen=True, slots=True, eq=False)
class PendingGoal:
    """A goal that waits for its reply: its hit, and the motion that it corrects."""

    goal_id: str
    choice: Choice
    revises: str | None


@dataclass(slots=True, eq=False)
class Attempt:
    """A ball on its way.

    Attributes:
        ball: Its number.
        stage: seen: no hit is planned; swinging: a hit is planned; struck: the ball has left the racket; over: it
            landed or was missed.
        choice: The hit that is played.
        candidates: Hits, or touches of a correction, to request next if the planner refuses.
        goal_id: Of the motion that is played.
        primitive: Imitated by that motion.
        pending: The goal that waits for its reply.
        rest_time: End of the motion that is played, robot time.
        revisions: Number of accepted corrections.
        next_search: When to search for a hit again, if none was found.
        sight_time: Time of the last sight that a decision has used.
        decision_time: Begin of that decision, robot time.
        sights: Times and positions of the ball after the planned touch.
        contact: Contact of ball and racket, if the robot side reports it.
        reason: Why no hit was found or played last.
        reason_kind: The kind of that reason.
    """

    ball: int
    stage: Stage = "seen"
    choice: Choice | None = None
    candidates: Iterator[Choice] = field(default_factory=lambda: iter(()))
    goal_id: str | None = None
    primitive: str = ""
    pending: PendingGoal | None = None
    rest_time: float = 0.0
    revisions: int = 0
    next_search: float = -np.inf
    sight_time: float = -np.inf
    decision_time: float = 0.0
    sights: list[tuple[float, np.ndarray]] = field(default_factory=list)
    contact: m.Contact | None = None
    reason: str = ""
    reason_kind: str = ""

    def has_flown(self, now: float) -> bool:
        """Return whether a ball that has left the racket is about to land at `now`, s."""
        assert self.choice is not None
        return now > self.choice.time + FLOWN * self.choice.flight_time
