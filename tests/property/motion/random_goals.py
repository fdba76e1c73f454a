"""Demonstrations and goals of one joint, drawn at random."""

from dataclasses import replace

import numpy as np

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest, Waypoint

TIMES = np.linspace(0, 1, 1001)


def make_primitive(*rngs: np.random.Generator) -> Primitive:
    """Learn from a random strike of 1 s, a joint for each generator."""
    return learn(Demonstration(TIMES, np.stack([_strike(rng) for rng in rngs], axis=1)))


def _strike(rng: np.random.Generator) -> np.ndarray:
    a, b, c = rng.uniform(-1, 1, 3)
    strike = 2 * TIMES**2 + np.cos(4 * np.pi * TIMES) * (1 - TIMES) - 1
    return a * strike + b * np.sin(3 * TIMES) + c * TIMES**3


def random_request(rng: np.random.Generator, primitive: Primitive, tail: str = "coast") -> MotionRequest:
    """One joint near its demonstration, with limits tighter than the motion that it would like to make; some
    with moving starts, given accelerations, way-points with free entries, a rest fraction."""
    free = np.full(1, np.nan)

    def accelerations() -> np.ndarray:
        return rng.uniform(-20, 20, 1) if rng.random() < 0.3 else free

    resting = rng.random() < 0.5
    start = Boundary(
        primitive.start.positions + rng.uniform(-0.2, 0.2, 1),
        np.zeros(1) if resting else primitive.start.velocities + rng.uniform(-0.3, 0.3, 1),
        np.zeros(1) if resting else accelerations(),
    )
    rest = rng.choice([0.0, 0.0, 0.05])
    goal = Boundary(
        primitive.goal.positions + rng.uniform(-0.2, 0.2, 1),
        primitive.goal.velocities + rng.uniform(-0.5, 0.5, 1),
        free if rest else accelerations(),
    )
    duration = rng.uniform(0.7, 1.3)
    waypoints = []
    if rng.random() < 0.3:
        time = rng.uniform(0.3, 0.7)
        there = primitive.demonstrated_positions(np.array([time]))[0] + rng.uniform(-0.1, 0.1, 1)
        waypoints.append(Waypoint(time * duration, there, free if rng.random() < 0.5 else np.zeros(1)))
    request = MotionRequest(start, goal, duration, Limits.unlimited(1), tuple(waypoints), float(rest), "coast")
    wish = plan(primitive, request).report.extremes
    fraction = rng.choice([0.95, 0.85])
    fixed_p = [start.positions[0], goal.positions[0], *(w.positions[0] for w in waypoints)]
    fixed_p.append(goal.positions[0] - rest * duration * goal.velocities[0])
    fixed_a = np.nan_to_num([start.accelerations[0], goal.accelerations[0]])

    def largest(quantity: str, *fixed: float) -> np.ndarray:
        return np.array([max(np.abs(wish[quantity]).max() * fraction, *(1.02 * abs(f) for f in fixed), 1e-3)])

    centre = sum(wish["position"][0]) / 2
    reach = [centre + fraction * (x - centre) for x in wish["position"][0]]
    on_limit = rng.random() < 0.2  # the outermost fixed value lies exactly on its limit
    slack = 0.0 if on_limit else 2e-2
    positions = [min(*fixed_p, reach[0]) - slack, max(*fixed_p, reach[1]) + slack]
    limits = Limits(
        np.array([positions]),
        largest("velocity", start.velocities[0], goal.velocities[0]) * (1 if rng.random() < 0.8 else 0.99),
        largest("acceleration", *fixed_a),
        largest("jerk"),
    )
    if on_limit and abs(goal.velocities[0]) * 1.02 >= limits.velocities[0]:
        limits = replace(limits, velocities=np.maximum(abs(goal.velocities), abs(start.velocities)))
    return replace(request, limits=limits, tail=tail)


def in_other_time(request: MotionRequest, factor: float) -> MotionRequest:
    """The same motion `factor` times as slow: velocities, accelerations and jerks, limits too, scale along."""
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
        limits=Limits(
            limits.positions, limits.velocities / factor, limits.accelerations / factor**2, limits.jerks / factor**3
        ),
        waypoints=tuple(
            replace(w, time_from_start=w.time_from_start * factor, velocities=w.velocities / factor)
            for w in request.waypoints
        ),
    )


def together(requests: list[MotionRequest]) -> MotionRequest:
    """One request of several joints from requests of one joint that last alike; each keeps its own way-points."""
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
    waypoints = [
        Waypoint(w.time_from_start, alone(joint, w.positions), alone(joint, w.velocities))
        for joint, request in enumerate(requests)
        for w in request.waypoints
    ]
    ends = stacked([request.start for request in requests]), stacked([request.goal for request in requests])
    return MotionRequest(*ends, requests[0].duration, limits, tuple(waypoints), tail=requests[0].tail)
