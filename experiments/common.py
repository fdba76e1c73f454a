"""Shared by the experiments: the figures' demonstration, requests and motions of one joint, rows of the table."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure

from motion.demonstration import Demonstration
from motion.dmp import Dmp
from motion.gaussian import plan_gaussian
from motion.limits import Limits
from motion.plan import Plan, plan
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest, Waypoint
from motion.trajectory import Samples

STEP = 1e-3
"""Length of the paper's Euler steps, s."""

TIMES = np.linspace(0, 1, 1001)

GOALS = 200
"""Number of random goals beside each single case."""


@dataclass(frozen=True, slots=True)
class Row:
    """One number of the table: dotted name, value, unit, and the paper's claim about it, if any."""

    name: str
    value: float
    unit: str
    paper_claim: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A curve for the trace: `path` like fig2/position/gaussian, times (n,), s, and values (n,)."""

    path: str
    times: np.ndarray
    values: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """The outcome of an experiment: rows, a figure, curves."""

    rows: list[Row]
    figure: Figure | None = None
    curves: list[Curve] = field(default_factory=list)


def demonstrated(times: np.ndarray) -> np.ndarray:
    """Return positions, velocities and accelerations (3, n) of d(t) = 2t² + cos(4πt)(1−t) − 1, in closed form.

    This is the demonstration of the authors' published code.
    """
    t, w = times, 4 * np.pi
    cosine, sine = np.cos(w * t), np.sin(w * t)
    return np.stack(
        [
            2 * t**2 + cosine * (1 - t) - 1,
            4 * t - w * sine * (1 - t) - cosine,
            4 - w**2 * cosine * (1 - t) + 2 * w * sine,
        ]
    )


def demonstration(positions: np.ndarray | None = None) -> Demonstration:
    """Return the figures' demonstration at 1 kHz, or other positions (n,) at the same times."""
    return Demonstration(TIMES, (demonstrated(TIMES)[0] if positions is None else positions)[:, None])


def figure_primitive() -> Primitive:
    """Return the primitive of the figures' demonstration, which needs no smoothing."""
    return learn(demonstration(), "none")


def state(position: float, velocity: float) -> Boundary:
    """Return a state of one joint with a free acceleration."""
    return Boundary(*(np.array([x]) for x in (position, velocity, np.nan)))


DEMONSTRATED_START, DEMONSTRATED_GOAL = state(0.0, -1.0), state(1.0, 3.0)


def limits(position: float = np.inf, jerk: float = np.inf) -> Limits:
    """Return limits of one joint: ±position (rad) and ±jerk (rad/s³)."""
    free = np.array([np.inf])
    return Limits(np.array([[-position, position]]), free, free, np.array([jerk]))


def ask(
    start: Boundary = DEMONSTRATED_START,
    goal: Boundary = DEMONSTRATED_GOAL,
    duration: float = 1.0,
    within: Limits | None = None,
    waypoint: tuple[float, float, float] | None = None,
    rest_fraction: float = 0.0,
) -> MotionRequest:
    """Return a request of one joint that moves on after the goal, as in the paper. `waypoint`: time, p, v."""
    waypoints = () if waypoint is None else (Waypoint(waypoint[0], *(np.array([x]) for x in waypoint[1:])),)
    return MotionRequest(start, goal, duration, within or limits(), waypoints, rest_fraction, "coast")


def gaussian(primitive: Primitive, request: MotionRequest) -> tuple[Plan, np.ndarray]:
    """Plan by the paper's quadratic program; return the plan and its motion."""
    made = plan_gaussian(primitive, request, STEP)
    return made, sampled(made)


def qp(primitive: Primitive, request: MotionRequest) -> tuple[Plan, np.ndarray]:
    """Plan by Volley's quadratic program on B-splines; return the plan and its motion."""
    made = plan(primitive, request, STEP)
    return made, sampled(made)


def sampled(made: Plan) -> np.ndarray:
    """Return the motion of the only joint up to the hit; the last acceleration is the limit from the left."""
    samples = made.sample(np.arange(made.hit_index + 1) * STEP)
    samples.accelerations[-1] = made.sample(np.array([made.duration - 1e-9])).accelerations[0]
    return motion_of(samples)


def rollout(dmp: Dmp, request: MotionRequest) -> np.ndarray:
    """Return the DMP's motion for the same request, by Euler steps."""
    return motion_of(dmp.rollout(request.start, request.goal, request.duration, STEP))


def motion_of(samples: Samples) -> np.ndarray:
    """Return the motion of the only joint: position, velocity and acceleration (3, n)."""
    return np.stack([samples.positions[:, 0], samples.velocities[:, 0], samples.accelerations[:, 0]])


def played(duration: float, count: int) -> np.ndarray:
    """Return the demonstration's acceleration τ²d̈ (count,), rad/s², when it is played in `duration` s."""
    return demonstrated(np.linspace(0, 1, count))[2] / duration**2


def rms(values: np.ndarray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def spread(name: str, values: Iterable[float], unit: str, claim: str | None = None) -> list[Row]:
    """Return rows with the median, minimum and maximum of values."""
    array = np.array(list(values))
    return [
        Row(f"{name}.median", float(np.median(array)), unit, claim),
        Row(f"{name}.least", float(array.min()), unit),
        Row(f"{name}.greatest", float(array.max()), unit),
    ]


def curves(figure: str, times: np.ndarray, motions: Mapping[str, np.ndarray]) -> list[Curve]:
    """Return motions (3, n), or their first rows, as curves of a figure."""
    return [
        Curve(f"{figure}/{quantity}/{name.replace('.', '_')}", times, values)
        for name, motion in motions.items()
        for quantity, values in zip(("position", "velocity", "acceleration"), motion, strict=False)
    ]
