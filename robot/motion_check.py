"""Whether a motion collides, and whether it needs more torque than the arm has."""

import math
import time
from dataclasses import dataclass
from typing import Literal

import numpy as np

from motion.errors import MotionError
from motion.trajectory import Samples, Trajectory
from robot.approach import approach
from robot.clearance import Clearance, Pair
from robot.description import RobotConfig
from robot.torques import InverseDynamics

STEP_S = 0.002
"""Instants at which a motion is looked at are multiples of this, or of the robot's tick if that is longer."""

SEGMENT = 500
"""Steps that are checked for collisions, then for torques, before those that follow."""

EVERY = 4
"""Torques are computed at every fourth step, and at all steps around one that comes near to a limit."""

NEAR_LIMIT = 0.85
"""Part of a torque limit, from which on every step is looked at."""

STEP_WAY = 5e-3
MAX_PARTS = 16
"""Within a step no pair may move by more than half of the margin, or this (m) if that is more; steps are divided by
at most so much."""

ROUNDING = 1e-9

ESCAPE = 1e-3
"""Bodies that are nearer than the margin when a motion begins may come this much (m) nearer still."""

AFTER = 200
"""Of two bodies that collide the distance is measured at so many instants after, for the smallest one."""

Scope = Literal["all", "part", "none"]


class Collides(MotionError):
    """Two bodies come nearer to each other than the margin.

    `time` (s from the start) is the first such instant, `distance` (m) the smallest distance of the two after it,
    negative: how deep they are in each other.
    """

    def __init__(self, pair: Pair, time: float, distance: float, margin: float) -> None:
        self.body, self.other = pair.bodies
        how = f"within {distance:.3f} m of" if distance > 0 else f"{-distance:.3f} m deep into"
        super().__init__(
            f"{self.body} comes {how} {self.other}, first nearer than the margin of {margin:g} m at {time:.3f} s; "
            "give waypoints around it, another end, or checks.collision = false"
        )
        self.time = time
        self.distance = distance


class TorqueExceeded(MotionError):
    """A motion needs more torque than a joint has.

    `time` (s from the start) is the first instant beyond `bound`, `value` (N·m, signed) the largest found in the second
    around it. `min_duration` (s) is a duration in which the motion can be played, None where none was found.
    """

    quantity = "torque"

    def __init__(self, joint: int, value: float, bound: float, time: float, min_duration: float | None = None) -> None:
        remedy = "give it more time" if min_duration is None else f"a duration of {min_duration:.6g} s works"
        super().__init__(
            f"joint {joint}: needs a torque of {abs(value):.4g} N·m, first more than its {abs(bound):.4g} N·m at "
            f"{time:.3f} s; {remedy}"
        )
        self.joint = joint
        self.value = value
        self.bound = bound
        self.time = time
        self.min_duration = min_duration

    def with_remedy(self, min_duration: float | None) -> "TorqueExceeded":
        """Return the error with a duration (s) that works."""
        return TorqueExceeded(self.joint, self.value, self.bound, self.time, min_duration)


@dataclass(frozen=True, slots=True)
class Nearest:
    """The smallest distance (m) that was measured along a motion, of which bodies, and when (s from its start)."""

    distance: float
    body: str
    other: str
    time: float


@dataclass(slots=True)
class Findings:
    """What a check found out.

    nearest: None where nothing can meet, or nothing was looked at. torque_use: (J,), largest part of each joint's
    torque limit, NaN where it has none; None where it was not looked at. scope: how much was looked at of what was
    asked for.
    """

    nearest: Nearest | None = None
    torque_use: np.ndarray | None = None
    scope: Scope = "none"


class MotionCheck:
    """Checks motions of one robot, along all of their way and their stop. It holds its own data: use one a thread."""

    def __init__(self, config: RobotConfig) -> None:
        model = config.load_model()
        self.clearance = Clearance(config, model)
        self._dynamics = InverseDynamics(config, model)
        self._limits = config.torques
        # A multiple of the tick, or a part of it, so that the arm passes through the steps.
        ticks = STEP_S / config.tick
        self._step = config.tick * (math.floor(ticks + 1e-9) if ticks >= 1 else 1 / math.ceil(1 / ticks))

    def check(
        self,
        trajectory: Trajectory,
        duration: float,
        collision: bool = True,
        torque: bool = True,
        deadline: float = math.inf,
    ) -> Findings:
        """Check a motion of `duration` (s).

        What comes first is checked first; beyond the `deadline` (`time.perf_counter`) the rest is left unchecked.

        Raises:
            Collides: two bodies come nearer than the margin. A pair that is nearer at the start may part.
            TorqueExceeded: a joint needs more torque than it has.
        """
        findings = Findings()
        if not (collision or torque):
            return findings
        if torque:
            findings.torque_use = np.where(np.isfinite(self._limits), 0.0, np.nan)
        floors = self._floors(trajectory)
        count = max(math.ceil(duration / self._step - 1e-9), 1)
        for first in range(0, count, SEGMENT):
            times = np.arange(first, min(first + SEGMENT, count) + 1) * self._step
            states = trajectory.sample(times)
            done = not collision or self._apart(trajectory, duration, times, states, floors, findings, deadline)
            if not done or (torque and not self._strong(times, states, findings, deadline)):
                findings.scope = "part"
                return findings
        findings.scope = "all"
        return findings

    def _floors(self, trajectory: Trajectory) -> np.ndarray:
        """Return the smallest distance (m) that each pair may have, (P,): less than the margin for those near now."""
        clearance = self.clearance
        clearance.place(trajectory.sample(np.zeros(1)).positions[0])
        distances = np.array([clearance.distance(pair) for pair in range(len(clearance.pairs))])
        return np.minimum(clearance.margin, np.where(distances < clearance.margin, distances - ESCAPE, np.inf))

    def _apart(
        self,
        trajectory: Trajectory,
        duration: float,
        times: np.ndarray,
        states: Samples,
        floors: np.ndarray,
        findings: Findings,
        deadline: float,
    ) -> bool:
        """Look for collisions; return whether all of the steps were looked at."""
        clearance = self.clearance
        if not clearance.pairs:
            return True
        ways = self._ways(states, times[1] - times[0])
        # Nothing may pass within a step: a fast arm gets more of them.
        parts = math.ceil(ways.max() / max(clearance.margin / 2, STEP_WAY)) if len(ways) else 1
        if parts > 1:
            times = np.linspace(times[0], times[-1], (len(times) - 1) * min(parts, MAX_PARTS) + 1)
            states = trajectory.sample(times)
            ways = self._ways(states, times[1] - times[0])
        ways = np.concatenate([np.zeros((len(ways), 1)), np.cumsum(ways, axis=1)], axis=1)
        best = findings.nearest.distance if findings.nearest else math.inf
        found = approach(clearance, states.positions, ways, floors, best, deadline)
        if found.hit is not None:
            pair, first = found.hit.pair, float(times[found.hit.step])
            deepest = self._deepest(pair, trajectory, first, duration)
            raise Collides(clearance.pairs[pair], first, deepest, clearance.margin)
        if found.nearest is not None and found.nearest.distance < best:
            near = found.nearest
            findings.nearest = Nearest(near.distance, *clearance.pairs[near.pair].bodies, float(times[near.step]))
        return found.complete

    def _deepest(self, pair: int, trajectory: Trajectory, first: float, duration: float) -> float:
        """Return the smallest distance of a pair from an instant on, m."""
        distances = []
        for positions in trajectory.sample(np.linspace(first, duration, AFTER)).positions:
            self.clearance.place(positions)
            distances.append(self.clearance.distance(pair))
        return min(distances)

    def _ways(self, states: Samples, step: float) -> np.ndarray:
        """Return by how much the joints can bring each pair nearer in each step, (P, n - 1), m."""
        # A joint that turns round within a step goes a little farther than from one to the other.
        turning = np.abs(states.accelerations).max(axis=0) * step**2 / 2
        return self.clearance.rates @ (np.abs(np.diff(states.positions, axis=0)) + turning).T

    def _strong(self, times: np.ndarray, states: Samples, findings: Findings, deadline: float) -> bool:
        """Look at the torques; return whether all of the steps were looked at."""
        last, limits = len(times) - 1, self._limits
        steps = np.unique(np.append(np.arange(0, last, EVERY), last))
        torques = self._torques(states, steps, deadline)
        near = steps[: len(torques)][(np.abs(torques) > NEAR_LIMIT * limits).any(axis=1)]
        between = np.unique(near[:, None] + np.arange(1 - EVERY, EVERY))
        between = np.setdiff1d(between[(between > 0) & (between < last)], steps)
        steps = np.concatenate([steps[: len(torques)], between])
        torques = np.concatenate([torques, self._torques(states, between, deadline)])
        steps = steps[: len(torques)]
        use = np.abs(torques) / limits
        beyond = np.flatnonzero((use > 1 + ROUNDING).any(axis=1))
        if beyond.size:
            first = beyond[steps[beyond].argmin()]
            joint = int(use[first].argmax())
            value = float(torques[use[:, joint].argmax(), joint])
            raise TorqueExceeded(joint, value, math.copysign(limits[joint], value), float(times[steps[first]]))
        assert findings.torque_use is not None
        findings.torque_use = np.maximum(findings.torque_use, use.max(axis=0, initial=0.0))
        return time.perf_counter() <= deadline

    def _torques(self, states: Samples, steps: np.ndarray, deadline: float) -> np.ndarray:
        """Return the torques at steps, (n, J), of fewer of them where time runs out."""
        found = np.empty((len(steps), len(self._limits)))
        for row, step in enumerate(steps.tolist()):
            if time.perf_counter() > deadline:
                return found[:row]
            found[row] = self._dynamics.torques(
                states.positions[step], states.velocities[step], states.accelerations[step]
            )
        return found
