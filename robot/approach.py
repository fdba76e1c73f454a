"""When a pair of geoms comes too near along a motion: conservative advancement.

Two bodies whose distance is d at one instant and e at another were never nearer between the two than (d + e − w) / 2,
where w is by how much the joints can have moved them meanwhile. Where spheres around the bodies show that they stay
apart, nothing is measured. Elsewhere the next look is as far ahead as this bound may reach, and a look between two
follows where it did not: pairs far apart are measured seldom, near ones often.
"""

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from heapq import heapify, heappop, heappush
from itertools import chain

import numpy as np

from robot.clearance import ROUGH, Clearance

PRECISION, SHARE = 2e-3, 0.1
"""The smallest distance along a motion is found to this much (m), or this part of it, where `LOOKS` suffice."""

LOOKS = 40
"""Most distances that are measured to find the smallest one, beside those that show that nothing collides."""

LIKELY = 0.4
"""Part of the fastest approach that the joints could cause, up to which a smaller distance is looked for."""

STRIDE = 1.8
"""How far ahead the next look is: times the way that the pair may go before it is too near. 2 would do for bodies
that do not come nearer meanwhile; more than 1 needs the look at the end."""

COARSE = 16
"""Spheres around the bodies are compared at every 16th step."""

STEP_WAY = 5e-3
MAX_PARTS = 16
"""Within a step no pair may move by more than half of the margin, or this (m) if that is more; steps are divided by
at most so much."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Distance (m) of a pair, and when: in steps."""

    distance: float
    pair: int
    step: float


@dataclass(frozen=True, slots=True)
class Approach:
    """nearest: None where nothing nearer than `best` was found. hit: the first below its floor."""

    nearest: Seen | None = None
    hit: Seen | None = None


Gap = tuple[float, int, int, float, int, float]
"""Instants between which a pair was not measured: the least distance (m) that is likely, the pair, the first instant
and the distance then, or less, the last one and the distance then, or less."""


def approach(
    clearance: Clearance,
    positions: np.ndarray,
    moved: np.ndarray,
    floors: np.ndarray,
    best: float = math.inf,
) -> Approach:
    """Return the smallest distance over the steps, and the first that is below its floor.

    positions: (n, K), one row a step, of the arm's joints, or of the other robots' too; n - 1 a multiple of `COARSE`.
    moved: (n - 1, K), by how much each joint moves at most in each step, rad. floors: (P,), m. best: nothing farther
    than this is of interest as the smallest distance.
    """
    passed = np.concatenate([np.zeros((1, moved.shape[1])), np.cumsum(moved, axis=0)])
    ways = clearance.rates[:, : moved.shape[1]] @ passed.T
    survey = _Survey(clearance, positions, ways)
    unclear = survey.least < floors
    near = np.flatnonzero(unclear.any(axis=0))
    # Nothing may pass within a step: a fast arm gets more of them.
    largest = float(np.diff(ways[near], axis=1).max(initial=0.0))
    parts = min(max(math.ceil(largest / max(clearance.margin / 2, STEP_WAY)), 1), MAX_PARTS)
    fine = _divided(ways[near], parts)
    look = _Look(clearance, positions, parts)
    runs = [
        _Run(pair, begin * COARSE * parts, end * COARSE * parts, float(survey.low[end, pair]), way, float(floors[pair]))
        for pair, way in zip(near.tolist(), map(memoryview, fine), strict=True)
        for begin, end in _stretches(unclear[:, pair])
    ]
    return _Search(look, survey, runs, floors, ways, best).run()


def _divided(ways: np.ndarray, parts: int) -> np.ndarray:
    """Return the ways (P, n) at the instants that divide steps, (P, (n - 1)·parts + 1)."""
    if parts == 1:
        return ways
    inner = ways[:, :-1, None] + np.diff(ways, axis=1)[..., None] * (np.arange(parts) / parts)
    return np.concatenate([inner.reshape(len(ways), -1), ways[:, -1:]], axis=1)


def _stretches(flags: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield the begin and end of each row of flags (n,) that are set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


class _Survey:
    """Lower bounds of all distances, by spheres around the bodies at every `COARSE`-th step.

    low: (k, P), at these steps; least: (k - 1, P), between them, m.
    """

    def __init__(self, clearance: Clearance, positions: np.ndarray, ways: np.ndarray) -> None:
        self.low = clearance.spheres(positions[::COARSE])
        way = np.diff(ways[:, ::COARSE].T, axis=0)
        self.least = (self.low[:-1] + self.low[1:] - way) / 2
        self._likely = self.least + (1 - LIKELY) / 2 * way

    def nearest(self) -> Seen:
        step, pair = divmod(int(self.low.argmin()), self.low.shape[1])
        return Seen(float(self.low[step, pair]), pair, step * COARSE)

    def gaps(self, floors: np.ndarray, below: float, parts: int) -> Iterator[Gap]:
        """Yield the gaps in which nothing is below its floor, but something is likely `below` a distance (m)."""
        open_ = (self.least >= floors) & (self._likely < below)
        for pair in np.flatnonzero(open_.any(axis=0)).tolist():
            for begin, end in _stretches(open_[:, pair]):
                low, instants = self.low[[begin, end], pair].tolist(), (begin * COARSE * parts, end * COARSE * parts)
                yield float(self._likely[begin:end, pair].min()), pair, instants[0], low[0], instants[1], low[1]


class _Look:
    """Distances at instants, whole steps and parts of them; the arm is moved only where the instant changes."""

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
    """Instants of a pair, from `begin` to `end`, between which spheres do not show that it stays apart.

    low: distance (m) at the end at least. way: how far the joints have moved the pair up to each instant, m. at: the
    last instant up to which all is known, and the distance then. ahead: measured instants beyond, the last one first.
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
        """Note a distance (m); return the next instant to look at, None where no more is needed."""
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
    """Looks along runs in the order of time, then into gaps for the smallest distance.

    nearest: the distance `best` (m), its pair and instant, once one was measured.
    """

    look: _Look
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
        if math.isinf(self.best):
            found = self.survey.nearest()
        return Approach(found, None if hit is None else self._seen(*hit))

    def _seen(self, distance: float, pair: int, instant: int) -> Seen:
        return Seen(distance, pair, instant / self.look.parts)

    def _measure(self, instant: int, pair: int) -> float:
        distance = self.look.at(instant, pair)
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
                instant = hit[2]  # what comes after is of no interest, but this pair may be too near before
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
        """Look into the gaps in which the distance could be smallest; return one that is below its floor."""
        parts, ways = self.look.parts, self.ways
        gaps = chain(self.survey.gaps(self.floors, min(self.best, ROUGH), parts), self.gaps)
        ranked = [gap for gap in gaps if self._matters(gap[0])]
        heapify(ranked)
        for _ in range(LOOKS):
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
