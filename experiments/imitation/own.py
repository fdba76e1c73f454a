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
"""Bound on a deviation, as a part of the joint's range, if that is more than the floor."""

SEEDS = 5
"""Number of recordings of a movement by each recorder; the worst one counts."""

GRID = 4001
"""Instants at which a plan is compared with a movement in closed form."""

STEP = 1e-3
"""Step of second differences, s."""

CLEAN = Recorder(500)


@dataclass(frozen=True, slots=True)
class Own:
    """One joint played under its demonstration's own conditions, rad and rad/s².

    acceleration_error: rms distance from the movement, or the standard error that learning reports if the movement is
    unknown. signal: rms of the acceleration. kink: largest distance of a sample from the middle of its neighbours, None
    for movements in closed form.
    """

    name: str
    joint: str
    functions: int
    range: float
    deviation: float
    bound: float
    acceleration_error: float
    signal: float
    kink: float | None = None

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


def of_recording(recording: Recorded) -> list[Own]:
    """Compare the plan with the samples, for each joint or coordinate."""
    demonstration = recording.demonstration
    primitive = learn(demonstration)
    played = ask(primitive).sample(demonstration.times - demonstration.times[0])
    beside = np.abs(played.positions - demonstration.positions).max(axis=0).tolist()
    spans = np.ptp(demonstration.positions, axis=0).tolist()
    kinks = np.abs(np.diff(demonstration.positions, 2, axis=0)).max(axis=0) / 2
    signals = np.sqrt(np.mean(played.accelerations**2, axis=0))
    return [
        Own(
            recording.name,
            joint,
            primitive.basis_count,
            spans[k],
            beside[k],
            bound(spans[k], float(primitive.noise_estimate[k]), recording.floor),
            float(primitive.fit_rms[k]),
            float(signals[k]),
            float(kinks[k]),
        )
        for k, joint in enumerate(recording.joints)
    ]


def nearest_to_bound(rows: list[Own]) -> Own:
    """Return the row whose deviation is the largest part of its bound."""
    return max(rows, key=lambda row: row.deviation / row.bound)
