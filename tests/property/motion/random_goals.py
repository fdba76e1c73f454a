"""Random demonstrations and goals, near and on their limits, that use every field of a request."""

from dataclasses import dataclass, replace

import numpy as np

from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest, Waypoint
from tests.splines_of import TIMES, figure_strike, fitted

FREE = np.full(1, np.nan)


def make_primitive(*rngs: np.random.Generator, basis_count: int = 50) -> Primitive:
    """Return a random strike of 1 s with one joint for each generator."""
    return fitted(TIMES, np.stack([_strike(rng) for rng in rngs], axis=1), basis_count)


def _strike(rng: np.random.Generator) -> np.ndarray:
    a, b, c = rng.uniform(-1, 1, 3)
    return a * figure_strike(TIMES) + b * np.sin(3 * TIMES) + c * TIMES**3


@dataclass(frozen=True, slots=True)
class Manner:
    """The fields that all joints of a request share, as in `MotionRequest`.

    `duration` is that of a whole demonstration.
    """

    duration: float
    rest_fraction: float = 0.0
    phase: float = 0.0
    place_time: float | None = None
    follow_through: float = 0.0


def plain_manner(rng: np.random.Generator) -> Manner:
    """Return a manner with the whole demonstration in another duration, sometimes with a straight end."""
    return Manner(rng.uniform(0.7, 1.3), float(rng.choice([0.0, 0.0, 0.05])))


def any_manner(rng: np.random.Generator) -> Manner:
    """Return a manner with a phase, a place time, and straight parts before and after the hit."""
    return Manner(
        duration=rng.uniform(0.7, 1.3),
        rest_fraction=float(rng.choice([0.0, 0.0, 0.05, 0.2])),
        phase=float(rng.choice([0.0, rng.uniform(0.0, 0.9)])),
        place_time=None if rng.random() < 0.5 else rng.uniform(0.1, 1.0),
        follow_through=float(rng.choice([0.0, 0.0, 0.03])),
    )


def random_request(
    rng: np.random.Generator, primitive: Primitive, tail: str = "coast", manner: Manner | None = None
) -> MotionRequest:
    """Return a request of one joint near its demonstration, with limits tighter than the motion without limits.

    Some requests have moving starts, prescribed accelerations, and waypoints with free entries. Prescribed values lie
    on their limits, near them, or inside.
    """
    manner = manner or plain_manner(rng)
    straight = manner.rest_fraction > 0 or manner.follow_through > 0
    left = 1 - manner.phase
    shown = primitive.sample(np.array([manner.phase]))

    def accelerations() -> np.ndarray:
        return rng.uniform(-20, 20, 1) if rng.random() < 0.3 else FREE

    resting = manner.phase == 0 and rng.random() < 0.5
    start = Boundary(
        shown.positions[0] + left * rng.uniform(-0.2, 0.2, 1),
        np.zeros(1) if resting else shown.velocities[0] + rng.uniform(-0.3, 0.3, 1),
        np.zeros(1) if resting else accelerations(),
    )
    goal = Boundary(
        primitive.goal.positions + left * rng.uniform(-0.2, 0.2, 1),
        np.zeros(1) if rng.random() < 0.1 else primitive.goal.velocities + rng.uniform(-0.5, 0.5, 1),
        FREE if straight else accelerations(),
    )
    request = MotionRequest(
        start,
        goal,
        manner.duration * left,
        Limits.unlimited(1),
        rest_fraction=manner.rest_fraction,
        place_time=manner.place_time,
        phase=manner.phase,
        tail="coast",
    )
    if rng.random() < 0.3:
        at = rng.uniform(0.3, 0.7)
        there = primitive.positions(np.array([manner.phase + left * at]))[0] + left * rng.uniform(-0.1, 0.1, 1)
        waypoint = Waypoint(at * request.duration, there, FREE if rng.random() < 0.5 else np.zeros(1))
        request = replace(request, waypoints=(waypoint,))
    wish = plan(primitive, request).report.extremes
    limits, further = _tight(rng, request, wish, tail), manner.follow_through if tail == "stop" else 0.0
    return replace(request, limits=limits, tail=tail, follow_through=further)


def _tight(rng: np.random.Generator, request: MotionRequest, wish: dict[str, np.ndarray], tail: str) -> Limits:
    """Return limits that allow a part of the range of the motion without limits, and all prescribed values."""
    start, goal, fraction = request.start, request.goal, rng.choice([0.95, 0.85])

    def headroom() -> float:
        return float(rng.choice([1.02, 1.02, 1.0, 1 + 1e-6]))

    def largest(quantity: str, *fixed: float) -> np.ndarray:
        room = headroom()
        return np.array([max(np.abs(wish[quantity]).max() * fraction, *(room * abs(f) for f in fixed), 1e-3)])

    velocities = largest("velocity", start.velocities[0], goal.velocities[0])
    accelerations = largest("acceleration", *np.nan_to_num([start.accelerations[0], goal.accelerations[0]]))
    jerks = largest("jerk")
    end = goal.positions[0] - request.rest_fraction * request.duration * goal.velocities[0]
    fixed = [start.positions[0], goal.positions[0], end, *(w.positions[0] for w in request.waypoints)]
    if tail == "stop":
        fixed.append(_stops_at(request, accelerations[0], jerks[0]))
    centre = sum(wish["position"][0]) / 2
    low, high = (centre + fraction * (x - centre) for x in wish["position"][0])
    slack = rng.choice([2e-2, 2e-2, 1e-4, 1e-9, 0.0])
    return Limits(np.array([[min(*fixed, low) - slack, max(*fixed, high) + slack]]), velocities, accelerations, jerks)


def _stops_at(request: MotionRequest, most: float, jerk: float) -> float:
    """Return the approximate position after the stop, with room for a final acceleration of half its limit."""
    v, a = abs(request.goal.velocities[0]), most / 2
    v, travel = v + a * a / (2 * jerk), a / jerk * (v + a * a / (3 * jerk))
    peak = min(np.sqrt(jerk * v), most)
    travel += v * (v / peak + peak / jerk) / 2
    sign = np.sign(request.goal.velocities[0])
    return float(request.goal.positions[0] + sign * (travel + request.follow_through * abs(request.goal.velocities[0])))


def in_other_time(request: MotionRequest, factor: float) -> MotionRequest:
    """Return the same motion, `factor` times as slow: velocities, accelerations, jerks and limits are scaled."""
    ends = [
        Boundary(end.positions, end.velocities / factor, end.accelerations / factor**2)
        for end in (request.start, request.goal)
    ]
    limits = request.limits
    return replace(
        request,
        start=ends[0],
        goal=ends[1],
        duration=request.duration * factor,
        follow_through=request.follow_through * factor,
        limits=Limits(
            limits.positions, limits.velocities / factor, limits.accelerations / factor**2, limits.jerks / factor**3
        ),
        waypoints=tuple(
            replace(w, time_from_start=w.time_from_start * factor, velocities=w.velocities / factor)
            for w in request.waypoints
        ),
    )


def together(requests: list[MotionRequest]) -> MotionRequest:
    """Merge requests of one joint, all of one manner, into one; each joint keeps its own waypoints."""
    count = len(requests)

    def stacked(ends: list[Boundary]) -> Boundary:
        columns = [[getattr(end, name)[0] for end in ends] for name in ("positions", "velocities", "accelerations")]
        return Boundary(*map(np.array, columns))

    def alone(joint: int, values: np.ndarray) -> np.ndarray:
        return np.where(np.arange(count) == joint, values[0], np.nan)

    every = [request.limits for request in requests]
    limits = Limits(
        np.concatenate([limits.positions for limits in every]),
        *(np.concatenate([getattr(limits, n) for limits in every]) for n in ("velocities", "accelerations", "jerks")),
    )
    waypoints = tuple(
        Waypoint(w.time_from_start, alone(joint, w.positions), alone(joint, w.velocities))
        for joint, request in enumerate(requests)
        for w in request.waypoints
    )
    ends = [stacked([getattr(request, name) for request in requests]) for name in ("start", "goal")]
    return replace(requests[0], start=ends[0], goal=ends[1], limits=limits, waypoints=waypoints)
