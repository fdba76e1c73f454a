"""The latency from a sight of the ball to the first command that it changed, and its parts."""

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from protocol import messages as m

LEGS = "striker", "planner", "handover", "lead"
"""Parts of the latency, which end when the planner has the goal, when it has the plan, when the controller has accepted
the plan, and when the motion begins."""


@dataclass(frozen=True, slots=True)
class Latency:
    """Latency of one motion, s of wall time.

    Attributes:
        total: From the message of a sight to the first command of the motion that it changed.
        legs: The parts, in the order of `LEGS`.
        is_first: Whether the motion was the first one for its ball; later ones are corrections.
    """

    total: float
    legs: tuple[float, ...]
    is_first: bool


def latencies(
    strikes: Iterable[m.Strike], results: Iterable[m.Result], routed_ns: Mapping[float, int]
) -> list[Latency]:
    """Return the latencies of the motions for one ball.

    Args:
        strikes: The striker's messages about the ball.
        results: Results of the motions.
        routed_ns: For the time of each sight, the Unix time at which the router had its message, ns.
    """
    decided = {s.goal_id: s for s in strikes if s.phase in ("planned", "revised")}
    found = []
    for result in results:
        strike, stamps = decided.get(result.goal_id), result.stamps
        began = routed_ns.get(strike.sight) if strike is not None and strike.sight is not None else None
        reached = stamps.requested, stamps.planned, stamps.accepted, stamps.first_command
        if strike is None or began is None or None in reached:
            continue
        at = [began, *(value for value in reached if value is not None)]
        legs = tuple((later - earlier) / 1e9 for earlier, later in itertools.pairwise(at))
        found.append(Latency(sum(legs), legs, strike.phase == "planned"))
    return found


def percentiles(values: list[float]) -> dict[str, float | None]:
    """Return the median and the 99th percentile, ms, of values in s; None without values."""
    if not values:
        return {"p50": None, "p99": None}
    return {name: round(1e3 * float(np.percentile(values, share)), 1) for name, share in (("p50", 50), ("p99", 99))}
