"""When a pair of geoms comes too near along a motion: conservative advancement.

A pair whose distance is d cannot be nearer than its floor before the joints have moved it by d less the floor. So each
pair is looked at next when its way could be used up, pairs far apart seldom, near ones often.
"""

import math
import time
from bisect import bisect_right
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np

from robot.clearance import Clearance

PRECISION, SHARE = 2e-3, 0.1
"""The smallest distance along a motion is found to this much (m), or this part of it, where `LOOKS` suffice."""

LOOKS = 60
"""Most distances that are measured to find the smallest one, beside those that show that nothing collides."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Distance (m) of a pair at a step."""

    distance: float
    pair: int
    step: int


@dataclass(frozen=True, slots=True)
class Approach:
    """nearest: None where nothing was measured. hit: the first that is below its floor. complete: up to the end."""

    nearest: Seen | None = None
    hit: Seen | None = None
    complete: bool = True


@dataclass(frozen=True, slots=True)
class _Gap:
    """Steps between which the distance of a pair was not measured; `last` is None up to the end of the steps."""

    first: Seen
    last: Seen | None

    def least(self, ways: np.ndarray) -> float:
        """Return the least distance (m) that the pair can have between them; ways: (P, n), as for `approach`."""
        way, first, last = ways[self.first.pair], self.first, self.last
        if last is None:
            return first.distance - (way[-1] - way[first.step])
        return (first.distance + last.distance - (way[last.step] - way[first.step])) / 2


def approach(
    clearance: Clearance,
    positions: np.ndarray,
    ways: np.ndarray,
    floors: np.ndarray,
    best: float = math.inf,
    deadline: float = math.inf,
) -> Approach:
    """Return the smallest distance over the steps, and the first that is below its floor.

    positions: (n, J), one row a step. ways: (P, n), how far the joints have moved each pair since the first step, m,
    not decreasing. floors: (P,), m. best: nothing farther than this is of interest as the smallest distance.
    deadline: of `time.perf_counter`.
    """
    look = _Look(clearance, positions)
    due = [(0, pair) for pair in range(len(floors))]
    nearest: Seen | None = None
    gaps: list[_Gap] = []
    latest: dict[int, Seen] = {}
    end = len(positions) - 1
    while due:
        step, pair = heappop(due)
        if step != look.step and time.perf_counter() > deadline:
            return Approach(nearest, complete=False)
        seen = look.at(step, pair)
        if nearest is None or seen.distance < nearest.distance:
            nearest = seen
        if seen.distance < floors[pair]:
            return Approach(nearest, hit=seen)
        way = ways[pair]
        following = bisect_right(way, way[step] + seen.distance - floors[pair]) - 1
        if pair in latest:
            gaps.append(_Gap(latest[pair], seen))
        latest[pair] = seen
        if following < end:
            heappush(due, (max(following, step + 1), pair))
        elif step < end:
            gaps.append(_Gap(seen, None))
    return _refined(look, ways, floors, gaps, nearest, best, deadline)


class _Look:
    """Distances at steps; the arm is moved only where the step changes."""

    def __init__(self, clearance: Clearance, positions: np.ndarray) -> None:
        self.step = -1
        self._clearance = clearance
        self._positions = positions

    def at(self, step: int, pair: int) -> Seen:
        if step != self.step:
            self._clearance.place(self._positions[step])
            self.step = step
        return Seen(self._clearance.distance(pair), pair, step)


def _refined(
    look: _Look,
    ways: np.ndarray,
    floors: np.ndarray,
    gaps: list[_Gap],
    nearest: Seen | None,
    best: float,
    deadline: float,
) -> Approach:
    """Look into the gaps in which the distance could be smallest."""
    best = best if nearest is None else min(best, nearest.distance)
    end = ways.shape[1] - 1

    def matters(bound: float) -> bool:
        return bound < best - max(PRECISION, SHARE * best)

    ranked = [(bound, index) for index, gap in enumerate(gaps) if matters(bound := gap.least(ways))]
    heapify(ranked)
    for _ in range(LOOKS):
        if not ranked or not matters(ranked[0][0]) or time.perf_counter() > deadline:
            break
        gap = gaps[heappop(ranked)[1]]
        step = end if gap.last is None else (gap.first.step + gap.last.step) // 2
        if step == gap.first.step:
            continue
        seen = look.at(step, gap.first.pair)
        if seen.distance < floors[seen.pair]:
            return Approach(seen, hit=seen)
        if seen.distance < best:
            best, nearest = seen.distance, seen
        parts = [_Gap(gap.first, seen)] + ([] if gap.last is None else [_Gap(seen, gap.last)])
        for part in parts:
            if matters(bound := part.least(ways)):
                gaps.append(part)
                heappush(ranked, (bound, len(gaps) - 1))
    return Approach(nearest)
