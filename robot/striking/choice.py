"""A chosen hit, and the reason if there is none."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

SIMILAR_POSTURE_RAD = 0.5
"""rad; postures that differ by at most this on every joint are similar."""
SIMILAR_HIT = 0.03, 0.15
"""rad on every joint, and m/s of the ball; hits that differ by at most this have the same simulated contact."""
Reason = Literal["no ball", "out of reach", "target", "limits", "late", "room"]


class NoHit(Exception):
    """No hit was found; `reason` is the condition that excluded the last candidates."""

    def __init__(self, reason: Reason, sentence: str) -> None:
        super().__init__(sentence)
        self.reason: Reason = reason


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """The state in which a motion begins: time (s, in the ball's clock), positions, velocities, accelerations (J,)."""

    time: float
    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """A hit.

    time: s, of the touch. goal_time: s, of the middle of the contact, when the arm has these positions (J,), rad, and
    velocities (J,), rad/s. flight_time: s, from the touch to the target (3,), m, at which the ball touches the surface.
    ball, incoming, outgoing: the ball's position and its velocities before and after the touch, (3,). law_error: (3,),
    m/s, difference of a simulated contact from the contact law, included in `outgoing`. racket_position, racket_normal,
    racket_velocity: in the middle of the contact, (3,); the normal points to the ball's side. side: 1 for the racket's
    front, −1 for its back. mobility: (3, 3), 1/kg. error: expected distance of the landing point from the target, m.
    use: largest part of any limit that a quintic uses.
    """

    time: float
    goal_time: float
    positions: np.ndarray
    velocities: np.ndarray
    flight_time: float
    target: np.ndarray
    ball: np.ndarray
    incoming: np.ndarray
    outgoing: np.ndarray
    law_error: np.ndarray
    racket_position: np.ndarray
    racket_normal: np.ndarray
    racket_velocity: np.ndarray
    side: int
    mobility: np.ndarray
    error: float
    use: float

    @property
    def contact(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Arguments of `ContactLaw.outgoing` and `derivatives` for one ball: mobility, incoming, racket and normal."""
        return self.mobility[None], self.incoming[None], self.racket_velocity[None], self.racket_normal[None]


def distinct_first(choices: Iterable[Choice]) -> Iterator[Choice]:
    """Yield hits in order, but those similar to an earlier one last: a planner that refuses one refuses both."""
    first: list[Choice] = []
    last: list[Choice] = []
    for choice in choices:
        if any(np.abs(choice.positions - other.positions).max() < SIMILAR_POSTURE_RAD for other in first):
            last.append(choice)
        else:
            first.append(choice)
            yield choice
    yield from last


def are_similar(choice: Choice, other: Choice) -> bool:
    """Return whether two hits are so similar that their simulated contacts agree."""
    turned = np.abs(choice.positions - other.positions).max()
    faster = np.abs(np.stack([choice.incoming - other.incoming, choice.outgoing - other.outgoing])).max()
    return bool(turned < SIMILAR_HIT[0] and faster < SIMILAR_HIT[1] and choice.side == other.side)
