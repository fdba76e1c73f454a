"""Compare plans under a demonstration's own conditions (start, goal and duration) with the demonstration."""

from dataclasses import dataclass

import numpy as np

from benchmarks.learning import rms
from benchmarks.recordings import Movement, Recorder
from experiments.imitation.recorded import FLOOR, Recorded
from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.plan import Plan, plan
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest

SHARE = 0.01
"""Bound of a deviation, as a part of the joint's range, unless the floor is larger."""

SEEDS = 5
"""Number of recordings of a movement by each recorder; the worst one is reported."""

GRID = 4001
"""Instants at which a plan is compared with a movement in closed form."""

STEP = 1e-3
"""Step of second differences, s."""

SLIP, SLIPS = 4, 81
"""Largest error of a sample's time that `retimed` allows, in samples, and number of errors that are tried."""

CLEAN = Recorder(500)


@dataclass(frozen=True, slots=True)
class Own:
    """One joint played under its demonstration's own conditions, rad and rad/s².

    acceleration_error: rms distance from the movement, or the standard error that learning reports if the movement is
    unknown. signal: rms of the acceleration. retimed: the deviation if every sample may belong to a time up to `SLIP`
    samples earlier or later, the same for all joints; None for movements in closed form and for samples with times.
    """

    name: str
    joint: str
    functions: int
    range: float
    deviation: float
    bound: float
    acceleration_error: float
    signal: float
    retimed: float | None = None

    @property
    def kept(self) -> bool:
        """Whether the deviation is within the bound."""
        return self.deviation <= self.bound


def bound(span: float, noise: float, floor: float = FLOOR) -> float:
    """Return the largest allowed deviation (rad) of a joint with this range and noise."""
    return max(SHARE * span, floor, 2 * noise)


def accelerations(movement: Movement, times: np.ndarray) -> np.ndarray:
    """Return the accelerations (n,) of a movement, by second differences if there is no closed form."""
    if movement.accelerations is not None:
        return movement.accelerations(times)
    before, here, after = (movement.positions(times + shift) for shift in (-STEP, 0.0, STEP))
    return (before - 2 * here + after) / STEP**2


def learned(movement: Movement, recorder: Recorder, seed: int = 0) -> Primitive:
    """Learn a primitive from one recording of a movement."""
    times, positions = recorder.record(movement, seed)
    return learn(Demonstration(times, positions[:, None]))


def ask(
    primitive: Primitive,
    start: Boundary | None = None,
    goal: Boundary | None = None,
    speed: float = np.inf,
    place_time: float | None = None,
) -> Plan:
    """Plan in the demonstration's duration, by default from its own start to its own goal."""
    joints = primitive.joint_count
    none = Limits.unlimited(joints)
    limits = Limits(none.positions, np.full(joints, speed), none.accelerations, none.jerks)
    begin, end = start or free(primitive.start), goal or free(primitive.goal)
    return plan(primitive, MotionRequest(begin, end, primitive.duration, limits, tail="coast", place_time=place_time))


def free(boundary: Boundary, shift: float = 0.0) -> Boundary:
    """Return the same state, `shift` rad away and with a free acceleration."""
    return Boundary(boundary.positions + shift, boundary.velocities, np.full(len(boundary.positions), np.nan))


def synthetic(movement: Movement, recorder: Recorder, seeds: int = SEEDS) -> Own:
    """Return the worst plan of several recordings of a movement, compared with the movement itself."""
    times = np.linspace(0, movement.duration, GRID)
    shown, signal = movement.positions(times), accelerations(movement, times)
    functions, deviations, errors = 0, [], []
    for seed in range(seeds):
        primitive = learned(movement, recorder, seed)
        played = ask(primitive).sample(times)
        functions = max(functions, primitive.basis_count)
        deviations.append(float(np.abs(played.positions[:, 0] - shown).max()))
        errors.append(rms(played.accelerations[:, 0] - signal))
    span, allowed = float(np.ptp(shown)), bound(float(np.ptp(shown)), recorder.noise)
    return Own(movement.name, str(recorder), functions, span, max(deviations), allowed, max(errors), rms(signal))


def of_recording(recording: Recorded, timed: bool = False) -> list[Own]:
    """Compare the plan with the samples, for each joint or coordinate; `timed`: the samples have times of their own."""
    demonstration = recording.demonstration
    primitive = learn(demonstration)
    planned = ask(primitive)
    played = planned.sample(demonstration.times - demonstration.times[0])
    beside = np.abs(played.positions - demonstration.positions).max(axis=0).tolist()
    spans = np.ptp(demonstration.positions, axis=0).tolist()
    bounds = [bound(spans[k], float(noise), recording.floor) for k, noise in enumerate(primitive.noise_estimate)]
    aside = [None] * len(bounds) if timed else retimed(demonstration, planned, np.array(bounds)).tolist()
    signals = np.sqrt(np.mean(played.accelerations**2, axis=0))
    return [
        Own(
            recording.name,
            joint,
            primitive.basis_count,
            spans[k],
            beside[k],
            bounds[k],
            float(primitive.fit_rms[k]),
            float(signals[k]),
            aside[k],
        )
        for k, joint in enumerate(recording.joints)
    ]


def retimed(demonstration: Demonstration, planned: Plan, bounds: np.ndarray) -> np.ndarray:
    """Return the largest deviations (J,) if each sample is compared at the best time near its own."""
    times = demonstration.times - demonstration.times[0]
    slips = np.linspace(-SLIP, SLIP, SLIPS) * times[-1] / (len(times) - 1)
    at = np.clip(times[:, None] + slips, 0.0, times[-1])
    played = planned.sample(at.ravel()).positions.reshape(*at.shape, -1)
    apart = np.abs(played - demonstration.positions[:, None])
    best = (apart / bounds).max(axis=2).argmin(axis=1)
    return apart[np.arange(len(times)), best].max(axis=0)


def nearest_to_bound(rows: list[Own]) -> Own:
    """Return the row whose deviation is the largest part of its bound."""
    return max(rows, key=lambda row: row.deviation / row.bound)
