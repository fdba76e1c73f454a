"""One ball: what was seen, planned and asked for, until it has landed."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from protocol import messages as m
from robot.striking.choice import Choice

Stage = Literal["seen", "swinging", "struck", "over"]


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """A hit that was seen: its time (s), the ball's position and velocity after it (3,), and when and where it lands.

    velocity and landing are None where too little was seen.
    """

    time: float
    position: np.ndarray
    velocity: np.ndarray | None
    landing: tuple[float, np.ndarray] | None


@dataclass(slots=True, eq=False)
class Asked:
    """A goal that was sent and is not answered: the hit that it is for, and the motion that it corrects."""

    goal_id: str
    choice: Choice
    revises: str | None


@dataclass(slots=True, eq=False)
class Attempt:
    """A ball on its way.

    Attributes:
        ball: Its number.
        stage: seen: no hit is planned; swinging: one is; struck: it has left the racket; over: it landed or was missed.
        choice: The hit that is played.
        further: Hits, or touches of a correction, that are tried where the planner refuses the ones before them.
        goal_id: Of the motion that is played.
        primitive: That it imitates.
        asked: The goal on its way.
        rest_time: When the motion that is played ends, robot time.
        revisions: Corrections that were taken.
        again: When a hit is looked for once more, where none was found.
        decided: Time of the newest sight that was decided on.
        began: When that decision began, robot time.
        sights: Times and positions of the ball after the planned touch.
        touch: Contact of ball and racket, where the robot side says so.
        reason: Why no hit was found or played last.
        refused_for: The kind of that reason.
    """

    ball: int
    stage: Stage = "seen"
    choice: Choice | None = None
    further: Iterator[Choice] = field(default_factory=lambda: iter(()))
    goal_id: str | None = None
    primitive: str = ""
    asked: Asked | None = None
    rest_time: float = 0.0
    revisions: int = 0
    again: float = -np.inf
    decided: float = -np.inf
    began: float = 0.0
    sights: list[tuple[float, np.ndarray]] = field(default_factory=list)
    touch: m.Contact | None = None
    reason: str = ""
    refused_for: str = ""
