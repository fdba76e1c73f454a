"""The score of a stroke, from contacts and sights of the ball only."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from protocol.messages import BallState, Contact
from robot.court import BALL, CourtConfig
from robot.striking.flight import GRAVITY

Place = tuple[float, float, float]
MAX_GAP_S = 0.1
"""A position of the ball is known for this time after a sight, s."""


@dataclass(frozen=True, slots=True)
class Score:
    """The result of a ball.

    hit: the arm touched it; hit_time: of the last touch, s. net: it touched the net after that. landed_at, landed_time:
    of its first touch of the surface after that, None before. distance: horizontal, from the target, m. returned: it
    landed in the court's region, over the net or after touching its top.
    """

    hit: bool = False
    hit_time: float | None = None
    net: bool = False
    landed_at: Place | None = None
    landed_time: float | None = None
    distance: float | None = None
    returned: bool = False


def score(
    contacts: Sequence[Contact], sights: Sequence[BallState], court: CourtConfig, bodies: frozenset[str], target: Place
) -> Score:
    """Return the score of a ball.

    Args:
        contacts: Since the throw, in any order.
        sights: Since the throw; the truth is used if there is one.
        court: The robot's.
        bodies: The arm's, as in its `RobotConfig`.
        target: Where it should land, m.
    """
    touches = sorted((contact.time, *contact.bodies) for contact in contacts if BALL in contact.bodies)
    hits = [time for time, *names in touches if bodies & set(names)]
    if not hits:
        return Score()
    after = [(time, set(names)) for time, *names in touches if time > hits[-1]]
    landings = [time for time, names in after if court.surface in names]
    landed = landings[0] if landings else None
    net_name = court.net.geom if court.net else None
    net = any(net_name in names and (landed is None or time <= landed) for time, names in after)
    if landed is None:
        return Score(True, hits[-1], net)
    place = place_at(sights, landed)
    if place is None:
        return Score(True, hits[-1], net, None, landed)
    inside = all(low <= place[axis] <= high for axis, (low, high) in enumerate(court.region))
    return Score(
        True, hits[-1], net, place, landed, float(np.hypot(place[0] - target[0], place[1] - target[1])), inside
    )


def place_at(sights: Sequence[BallState], time: float) -> Place | None:
    """Return the ball's position at `time`, extrapolated from the last sight before it; None if that is too old."""
    before = [sight for sight in sights if time - MAX_GAP_S <= sight.time <= time]
    if not before:
        return None
    newest = max(before, key=lambda sight: sight.time)
    seen = newest.truth or newest
    gap = time - newest.time
    if seen.velocity is None:
        x, y, z = seen.position
        return x, y, z
    x, y, z = (np.array(seen.position) + gap * np.array(seen.velocity) + [0.0, 0.0, -GRAVITY * gap**2 / 2]).tolist()
    return x, y, z
