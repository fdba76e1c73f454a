"""Compare with the demonstration: a pick and place under speed limits, and movements between other ends."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.learning import rms
from benchmarks.recordings import HANDWRITING, PICK_AND_PLACE, SLOW, Movement
from experiments.imitation.own import CLEAN, GRID, accelerations, ask, free, learned
from motion.primitive import Primitive
from motion.request import Boundary

RATIOS = 1.01, 0.95, 0.9, 0.8, 0.7
"""Speed limits, as parts of the demonstrated peak."""

NO_PLACES = 1e6
"""Place time, s, with which the place term vanishes, so that the cost is the paper's."""

PLACE_TIMES: dict[str, float | None] = {"none": NO_PLACES, "default": None, "0.25": 0.25}
ENDS_TIMES: dict[str, float | None] = {"none": None, "0.5": 0.5, "0.25": 0.25}

AWAY = 1.0
"""Distance, s, of the middle of a motion from its ends."""


@dataclass(frozen=True, slots=True)
class Limited:
    """A pick and place under a speed limit: largest and rms deviation, rad, and rms acceleration error, rad/s²."""

    ratio: float
    places: str
    deviation: float
    rms: float
    acceleration_error: float


@dataclass(frozen=True, slots=True)
class Adapted:
    """A movement between other ends: largest deviation, rad, over the whole motion and in its middle."""

    name: str
    place_time: str
    largest: float
    middle: float
    acceleration_error: float
    peak: float


def limited() -> Iterator[Limited]:
    """Yield the pick and place under speed limits, with and without a place term."""
    primitive = learned(PICK_AND_PLACE, CLEAN)
    times = np.linspace(0, PICK_AND_PLACE.duration, GRID)
    shown, signal = PICK_AND_PLACE.positions(times), accelerations(PICK_AND_PLACE, times)
    peak = peak_speed(primitive)
    for ratio in RATIOS:
        for places, place_time in PLACE_TIMES.items():
            played = ask(primitive, speed=ratio * peak, place_time=place_time).sample(times)
            beside = played.positions[:, 0] - shown
            error = rms(played.accelerations[:, 0] - signal)
            yield Limited(ratio, places, float(np.abs(beside).max()), rms(beside), error)


def peak_speed(primitive: Primitive) -> float:
    """Return the largest speed of a demonstration, rad/s."""
    return float(np.abs(primitive.sample(np.linspace(0, 1, GRID)).velocities).max())


def other_ends() -> dict[str, tuple[Movement, Primitive, Boundary, Boundary]]:
    """Return movements with the ends between which they are played."""
    work, pen, slow = (learned(movement, CLEAN) for movement in (PICK_AND_PLACE, HANDWRITING, SLOW))
    still = np.zeros(1)
    return {
        "pick and place, start +0.2 rad, goal −0.15 rad": (
            PICK_AND_PLACE,
            work,
            free(work.start, 0.2),
            free(work.goal, -0.15),
        ),
        "handwriting, start +0.1 rad, goal −0.08 rad": (HANDWRITING, pen, free(pen.start, 0.1), free(pen.goal, -0.08)),
        "slow reach that begins and ends moving, from rest to rest": (
            SLOW,
            slow,
            Boundary(slow.start.positions, still, still),
            Boundary(slow.goal.positions, still, still),
        ),
    }


def adapted() -> Iterator[Adapted]:
    """Yield movements between other ends, with differences spread over the whole motion or kept near the ends."""
    for name, (movement, primitive, start, goal) in other_ends().items():
        times = np.linspace(0, movement.duration, GRID)
        middle = (times >= AWAY) & (times <= movement.duration - AWAY)
        for label, place_time in ENDS_TIMES.items():
            played = ask(primitive, start, goal, place_time=place_time).sample(times)
            beside = np.abs(played.positions[:, 0] - movement.positions(times))
            error = rms(played.accelerations[:, 0] - accelerations(movement, times))
            peak = float(np.abs(played.accelerations).max())
            yield Adapted(name, label, float(beside.max()), float(beside[middle].max()), error, peak)
