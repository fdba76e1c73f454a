"""Goals with active limits, drawn from a seed."""

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from motion.demonstration import Demonstration
from motion.errors import MotionError
from motion.limits import Limits
from motion.plan import Plan, plan
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest

FOREHAND = Path(__file__).parents[1] / "deploy" / "demonstrations" / "forehand.csv"


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A goal with active limits, and the goal planned before it: 5 mrad away, 1 % longer."""

    request: MotionRequest
    before: MotionRequest


def forehand(basis_count: int = 50, joints: int = 6) -> Primitive:
    """Learn the demonstration that ships with Volley, its first `joints` joints (repeated beyond six)."""
    data = np.loadtxt(FOREHAND, delimiter=",", skiprows=1)
    columns = 1 + np.arange(joints) % (data.shape[1] - 1)
    return learn(Demonstration(data[:, 0], data[:, columns]), basis_count=basis_count)


def joints_of(primitive: Primitive, joints: slice) -> Primitive:
    """Return a primitive with some joints of a primitive."""
    values = {each.name: getattr(primitive, each.name) for each in fields(primitive)}
    rows = {name: value[joints] for name, value in values.items() if isinstance(value, np.ndarray)}
    return replace(primitive, **rows)


def joint_of(primitive: Primitive, joint: int) -> Primitive:
    """Return a primitive with one joint of a primitive."""
    return joints_of(primitive, slice(joint, joint + 1))


def draw(primitive: Primitive, count: int, seed: int) -> list[Case]:
    """Return `count` random cases with active limits; refused goals are left out.

    Every joint's velocity, acceleration and jerk limits are 0.85 or 0.95 of the peaks of the motion without limits, and
    its position limits are inside the range of that motion.
    """
    rng = np.random.default_rng(seed)
    cases: list[Case] = []
    while len(cases) < count:
        request = _random_request(primitive, rng)
        try:
            request = replace(
                request, limits=_tight(plan(primitive, request), float(rng.choice([0.95, 0.85]))), tail="stop"
            )
            before = _nearby(request)
            plan(primitive, before)
            if plan(primitive, request).report.active:
                cases.append(Case(request, before))
        except MotionError:
            continue
    return cases


def _random_request(primitive: Primitive, rng: np.random.Generator) -> MotionRequest:
    """Return a random goal near the demonstrated one, without limits."""
    joints = primitive.joint_count
    free = np.full(joints, np.nan)
    start = Boundary(primitive.start.positions + rng.uniform(-0.05, 0.05, joints), np.zeros(joints), np.zeros(joints))
    goal = Boundary(
        primitive.goal.positions + rng.uniform(-0.2, 0.2, joints),
        primitive.goal.velocities * rng.uniform(0.7, 1.2, joints),
        free,
    )
    duration = round(primitive.duration * rng.uniform(0.7, 1.3), 3)
    return MotionRequest(start, goal, duration, Limits.unlimited(joints), tail="coast")


def _nearby(request: MotionRequest) -> MotionRequest:
    goal = replace(request.goal, positions=request.goal.positions - 0.005)
    return replace(request, goal=goal, duration=round(request.duration * 1.01, 3))


def _tight(unlimited: Plan, fraction: float) -> Limits:
    """Return limits inside the peaks of a motion, outside its ends, with room to stop after it."""
    request, extremes = unlimited.request, unlimited.report.extremes
    largest = {name: np.abs(values).max(axis=1) * fraction for name, values in extremes.items()}
    ends = np.stack([request.start.positions, request.goal.positions])
    centre = extremes["position"].mean(axis=1)
    reach = centre[:, None] + fraction * (extremes["position"] - centre[:, None])
    velocities = np.maximum(largest["velocity"], 1.02 * np.abs(request.goal.velocities)) + 1e-2
    accelerations, jerks = largest["acceleration"], largest["jerk"]
    # Distance travelled by a stop from the goal that begins with the acceleration at its limit.
    stop = np.abs(request.goal.velocities) ** 2 / (2 * accelerations) + accelerations**3 / (24 * jerks**2)
    stop += np.abs(request.goal.velocities) * accelerations / jerks
    after = request.goal.positions + 1.1 * np.sign(request.goal.velocities) * stop
    low = np.minimum(np.minimum(ends.min(axis=0) - 2e-2, reach[:, 0]), after - 1e-3)
    high = np.maximum(np.maximum(ends.max(axis=0) + 2e-2, reach[:, 1]), after + 1e-3)
    return Limits(np.stack([low, high], axis=1), velocities, accelerations, jerks)
