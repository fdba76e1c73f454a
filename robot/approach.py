"""Smallest distance along a motion, and the first one below a bound: conservative advancement.

If the distance of two bodies is d at one instant and e at another, it is at least (d + e − w) / 2 in between, where w
bounds their relative displacement in that interval. Intervals in which bounding spheres prove clearance are skipped.
In the remaining intervals, each step is as long as this bound is expected to allow; an interval that the bound does
not clear is bisected. So distant pairs are measured seldom, and near ones often.
"""

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from heapq import heapify, heappop, heappush
from itertools import chain

import numpy as np

from robot.clearance import ROUGH, Clearance

PRECISION, SHARE = 2e-3, 0.1
"""Absolute (m) and relative precision of the smallest distance along a motion, if `REFINEMENTS` suffice."""

REFINEMENTS = 40
"""Limit on the number of distances that are measured only to refine the smallest one."""

LIKELY = 0.4
"""Fraction of the largest possible approach that is assumed when gaps are ranked by their likely smallest distance."""

STRIDE = 1.8
"""Length of a step, in units of the displacement after which the pair could be too near. 2 suffices for bodies that do
not approach each other; above 1, the measurement at the end of the step is needed."""

COARSE = 16
"""Bounding spheres are compared at every 16th step."""

STEP_WAY = 5e-3
MAX_PARTS = 16
"""Largest displacement of a pair in a step (m), unless half of the margin is larger, and the most parts into which a
step is divided for that."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Distance (m) of a pair, and its time in steps."""

    distance: float
    pair: int
    step: float


@dataclass(frozen=True, slots=True)
class Approach:
    """nearest: smallest distance, None if none below `best` was found; above `ROUGH` a lower bound of all distances.

    hit: first distance below its floor.
    """

    nearest: Seen | None = None
    hit: Seen | None = None


Gap = tuple[float, int, int, float, int, float]
"""Interval in which a pair was not measured: its likely smallest distance (m), the pair, then the first instant with a
lower bound of the distance, and the last instant with a lower bound."""


def approach(
    clearance: Clearance,
    positions: np.ndarray,
    moved: np.ndarray,
    floors: np.ndarray,
    best: float,
) -> Approach:
    """Return the smallest distance over the steps, and the first one below its floor.

    positions: (n, K), rad, one row a step, of the arm's joints and optionally of the other robots'; n - 1 is a multiple
    of `COARSE`. moved: (n - 1, K), rad, largest displacement of each joint in each step. floors: (P,), m, a bound for
    each pair. best: distances above this are ignored as the smallest one, m.
    """
    passed = np.concatenate([np.zeros((1, moved.shape[1])), np.cumsum(moved, axis=0)])
    ways = clearance.rates[:, : moved.shape[1]] @ passed.T
    survey = _Survey(clearance, positions, ways)
    unclear = survey.least < floors
    near = np.flatnonzero(unclear.any(axis=0))
    # A body must not pass another within a step, so a fast arm gets more steps.
    largest = float(np.diff(ways[near], axis=1).max(initial=0.0))
    parts = min(max(math.ceil(largest / max(clearance.margin / 2, STEP_WAY)), 1), MAX_PARTS)
    fine = _divided(ways[near], parts)
    distances = _Distances(clearance, positions, parts)
    runs = [
        _Run(pair, begin * COARSE * parts, end * COARSE * parts, float(survey.low[end, pair]), way, float(floors[pair]))
        for pair, way in zip(near.tolist(), map(memoryview, fine), strict=True)
        for begin, end in _stretches(unclear[:, pair])
    ]
    return _Search(distances, survey, runs, floors, ways, best).run()


def _divided(ways: np.ndarray, parts: int) -> np.ndarray:
    """Return the displacements (P, n) at the instants that divide steps, (P, (n - 1)·parts + 1)."""
    if parts == 1:
        return ways
    inner = ways[:, :-1, None] + np.diff(ways, axis=1)[..., None] * (np.arange(parts) / parts)
    return np.concatenate([inner.reshape(len(ways), -1), ways[:, -1:]], axis=1)


def _stretches(flags: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield the begin and end of each run of set flags (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


class _Survey:
    """Lower bounds of all distances, from bounding spheres at every `COARSE`-th step.

    low: (k, P), at these steps, m; least: (k - 1, P), between them, m.
    """

    def __init__(self, clearance: Clearance, positions: np.ndarray, ways: np.ndarray) -> None:
        self.low = clearance.spheres(positions[::COARSE])
        way = np.diff(ways[:, ::COARSE].T, axis=0)
        self.least = (self.low[:-1] + self.low[1:] - way) / 2
        self._likely = self.least + (1 - LIKELY) / 2 * way

    def nearest(self, measured: Seen | None) -> Seen:
        """Return a lower bound of all distances, if none was found within `ROUGH`, for the nearest pair known."""
        step, pair = divmod(int(self.low.argmin()), self.low.shape[1])
        known = measured or Seen(float(self.low[step, pair]), pair, step * COARSE)
        return replace(known, distance=max(float(self.least.min()), ROUGH))

    def gaps(self, floors: np.ndarray, below: float, parts: int) -> Iterator[Gap]:
        """Yield the gaps that are clear of their floors, but whose likely smallest distance is below `below` (m)."""
        open_ = (self.least >= floors) & (self._likely < below)
        for pair in np.flatnonzero(open_.any(axis=0)).tolist():
            for begin, end in _stretches(open_[:, pair]):
                low, instants = self.low[[begin, end], pair].tolist(), (begin * COARSE * parts, end * COARSE * parts)
                yield float(self._likely[begin:end, pair].min()), pair, instants[0], low[0], instants[1], low[1]


class _Distances:
    """Distances at instants, which are parts of steps; sets the arm's pose only when the instant changes."""

    def __init__(self, clearance: Clearance, positions: np.ndarray, parts: int) -> None:
        self.parts = parts
        self._instant = -1
        self._clearance = clearance
        self._positions = positions

    def at(self, instant: int, pair: int) -> float:
        if instant != self._instant:
            step, part = divmod(instant, self.parts)
            pose = self._positions[step]
            if part:
                pose = pose + (self._positions[step + 1] - pose) * (part / self.parts)
            self._clearance.place(pose)
            self._instant = instant
        return self._clearance.distance(pair)


@dataclass(slots=True, eq=False)
class _Run:
    """Interval of a pair, from `begin` to `end`, in which bounding spheres do not prove clearance.

    low: lower bound of the distance at the end, m. way: bound of the pair's displacement up to each instant, m. at: the
    instant up to which the pair is proved clear, and its distance there. ahead: later measured instants, latest first.
    """

    pair: int
    begin: int
    end: int
    low: float
    way: memoryview
    floor: float
    at: tuple[int, float] | None = None
    ahead: list[tuple[int, float]] = field(default_factory=list)

    def following(self, instant: int, distance: float, gaps: list[Gap]) -> int | None:
        """Add a measured distance (m); return the next instant to measure, or None if no more is needed."""
        way, floor = self.way, self.floor
        if self.at is None:
            self.at = instant, distance
        else:
            self.ahead.append((instant, distance))
        first, before = self.at
        while self.ahead:
            last, after = self.ahead[-1]
            gone = way[last] - way[first]
            if before + after - gone < 2 * floor and last > first + 1:
                return (first + last) // 2
            gaps.append(((before + after - LIKELY * gone) / 2, self.pair, first, before, last, after))
            self.at = first, before = self.ahead.pop()
        if before < floor or first == self.end:
            return None
        rest = way[self.end] - way[first]
        if before + max(self.low, before - rest) - rest >= 2 * floor:
            gaps.append((before - LIKELY * rest, self.pair, first, before, self.end, self.low))
            return None
        return max(bisect_right(way, way[first] + STRIDE * (before - floor), first, self.end + 1) - 1, first + 1)


@dataclass(slots=True, eq=False)
class _Search:
    """Searches runs in the order of time for a collision, then gaps for the smallest distance.

    nearest: the smallest measured distance (`best`, m), its pair and its instant; None before the first.
    """

    distances: _Distances
    survey: _Survey
    runs: list[_Run]
    floors: np.ndarray
    ways: np.ndarray
    best: float
    nearest: tuple[float, int, int] | None = None
    gaps: list[Gap] = field(default_factory=list)

    def run(self) -> Approach:
        hit = self._advance() or self._refine()
        found = None if self.nearest is None else self._seen(*self.nearest)
        if self.best > ROUGH:
            found = self.survey.nearest(found)
        return Approach(found, None if hit is None else self._seen(*hit))

    def _seen(self, distance: float, pair: int, instant: int) -> Seen:
        return Seen(distance, pair, instant / self.distances.parts)

    def _measure(self, instant: int, pair: int) -> float:
        distance = self.distances.at(instant, pair)
        if distance < self.best:
            self.best, self.nearest = distance, (distance, pair, instant)
        return distance

    def _advance(self) -> tuple[float, int, int] | None:
        """Return the first distance below its floor, its pair and instant."""
        due = [(run.begin, number) for number, run in enumerate(self.runs)]
        heapify(due)
        hit: tuple[float, int, int] | None = None
        while due:
            instant, number = heappop(due)
            run = self.runs[number]
            if hit is not None and instant >= hit[2]:
                if run.at is None or run.at[0] >= hit[2]:
                    continue
                instant = hit[2]  # later instants do not matter, but this pair may be too near before the hit
            distance = self._measure(instant, run.pair)
            if distance < run.floor and (hit is None or instant < hit[2]):
                hit = distance, run.pair, instant
            following = run.following(instant, distance, self.gaps)
            if following is not None:
                heappush(due, (following, number))
        return hit

    def _matters(self, bound: float) -> bool:
        best = min(self.best, ROUGH)
        return bound < best - max(PRECISION, SHARE * best)

    def _refine(self) -> tuple[float, int, int] | None:
        """Measure in the gaps with the likely smallest distances; return one below its floor."""
        parts, ways = self.distances.parts, self.ways
        gaps = chain(self.survey.gaps(self.floors, min(self.best, ROUGH), parts), self.gaps)
        ranked = [gap for gap in gaps if self._matters(gap[0])]
        heapify(ranked)
        for _ in range(REFINEMENTS):
            if not ranked or not self._matters(ranked[0][0]):
                break
            _, pair, first, before, last, after = heappop(ranked)
            instant = (first + last) // 2
            if instant == first:
                continue
            distance = self._measure(instant, pair)
            if distance < self.floors[pair]:
                return distance, pair, instant
            for begin, end, known in ((first, instant, before), (instant, last, after)):
                way = LIKELY * float(ways[pair, end // parts] - ways[pair, begin // parts])
                known = max(known, distance - way)
                least = (known + distance - way) / 2
                if self._matters(least):
                    there = (known, distance) if begin == first else (distance, known)
                    heappush(ranked, (least, pair, begin, there[0], end, there[1]))
        return None
