"""Where the time goes from a sight of the ball to the first command that it changed."""

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from protocol import messages as m

LEGS = "striker", "planner", "handover", "lead"
"""Until the planner has the goal; until it has the plan; until the controller has that; until the motion begins."""


@dataclass(frozen=True, slots=True)
class Latency:
    """s of wall time. total: from a sight's message to the first command of the motion that it changed.

    is_first: whether that motion was the first for its ball; the others are corrections. legs: the parts, as `LEGS`.
    """

    total: float
    legs: tuple[float, ...]
    is_first: bool


def latencies(said: Iterable[m.Strike], results: Iterable[m.Result], seen: Mapping[float, int]) -> list[Latency]:
    """Return the latencies of the motions of a ball.

    Args:
        said: What the striker said of it.
        results: Of its motions.
        seen: Unix ns at which the router had the message of a sight, by the sight's time.
    """
    decided = {s.goal_id: s for s in said if s.phase in ("planned", "revised")}
    found = []
    for result in results:
        strike, stamps = decided.get(result.goal_id), result.stamps
        began = seen.get(strike.sight) if strike is not None and strike.sight is not None else None
        reached = stamps.requested, stamps.planned, stamps.accepted, stamps.first_command
        if strike is None or began is None or None in reached:
            continue
        at = [began, *(value for value in reached if value is not None)]
        legs = tuple((later - earlier) / 1e9 for earlier, later in itertools.pairwise(at))
        found.append(Latency(sum(legs), legs, strike.phase == "planned"))
    return found


def percentiles(values: list[float]) -> dict[str, float | None]:
    """Return median and 99th percentile in ms of values in s, None of nothing."""
    if not values:
        return {"p50": None, "p99": None}
    return {name: round(1e3 * float(np.percentile(values, share)), 1) for name, share in (("p50", 50), ("p99", 99))}
