"""Check motions for collisions and for torques beyond the arm's limits."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from motion.errors import MotionError
from motion.trajectory import Samples, Trajectory
from robot.approach import COARSE, approach
from robot.clearance import Clearance, Pair
from robot.description import RobotConfig
from robot.other_motions import OtherMotion
from robot.torque_check import TorqueCheck

STEP_S = 0.002
"""Shortest step of the checked instants, s; a longer tick of the robot replaces it."""

SEGMENT = 32 * COARSE
"""Number of steps that are checked for collisions and then for torques before the next ones."""

ESCAPE = 1e-3
"""Allowed decrease (m) of a distance that is below the margin already at the motion's start."""

AFTER = 200
"""Number of instants after a collision at which the two bodies' distance is measured, to report the smallest one."""

Scope = Literal["all", "none"]


class Collides(MotionError):
    """Two bodies come nearer to each other than the margin.

    `time` (s from the start) is the first such instant, `distance` (m) their smallest distance after it; negative:
    penetration depth.
    """

    def __init__(self, pair: Pair, time: float, distance: float, margin: float, clear_at: float | None = None) -> None:
        """Describe the collision; `clear_at`: end of the other robot's motion, if any, s on the robot's clock."""
        self.body, self.other = pair.bodies
        how = f"within {distance:.3f} m of" if distance > 0 else f"{-distance:.3f} m deep into"
        later = "" if clear_at is None else f"begin after {clear_at:.3f} s, when the other robot's motion has ended, "
        super().__init__(
            f"{self.body} comes {how} {self.other}, first nearer than the margin of {margin:g} m at {time:.3f} s; "
            f"{later}give waypoints around it, another end, or checks.collision = false"
        )
        self.time = time
        self.distance = distance


@dataclass(frozen=True, slots=True)
class Nearest:
    """The smallest measured distance (m) along a motion, its two bodies, and its time (s from the start)."""

    distance: float
    body: str
    other: str
    time: float


@dataclass(slots=True)
class Findings:
    """Result of a check.

    nearest: None if no bodies can collide, or collisions were not checked. torque_use: (J,), largest used fraction of
    each joint's torque limit, NaN for a joint without a limit; None if torques were not checked. scope: whether
    anything was checked.
    """

    nearest: Nearest | None = None
    torque_use: np.ndarray | None = None
    scope: Scope = "none"


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """A motion together with the motions of other robots.

    duration: duration of the motion, s. begin: its start, s on the robot's clock. until: time at which all robots are
    at rest, s from the start.
    """

    trajectory: Trajectory
    duration: float
    begin: float
    until: float
    others: tuple[OtherMotion, ...]

    def sample(self, times: np.ndarray) -> Samples:
        """Return the states of the arm's joints, then the other robots', (n, J + O) at times (n,) from the start, s."""
        own = self.trajectory.sample(np.minimum(times, self.duration))
        if not self.others:
            return own
        states = [np.array([own.positions, own.velocities, own.accelerations])]
        states += [other.sample(self.begin + times) for other in self.others]
        return Samples(*np.concatenate(states, axis=2))


class MotionCheck:
    """Checks motions of one robot, including the stop. Not thread-safe: use one a thread.

    others: motions of the other robots in the model, in the order of the robot's TOML; empty if none of them moves:
    they then stand at their pose in `clearance`.
    """

    def __init__(self, config: RobotConfig) -> None:
        model = config.load_model()
        self.clearance = Clearance(config, model)
        self.others: tuple[OtherMotion, ...] = ()
        self._joints = config.joint_count
        self._torques = TorqueCheck(config, model)
        # A multiple or a fraction of the tick, so that the steps coincide with ticks.
        ticks = STEP_S / config.tick
        self._step = config.tick * (math.floor(ticks + 1e-9) if ticks >= 1 else 1 / math.ceil(1 / ticks))

    def check(
        self,
        trajectory: Trajectory,
        duration: float,
        collision: bool = True,
        torque: bool = True,
        begin: float | None = None,
    ) -> Findings:
        """Check a motion of `duration` (s) that begins at `begin` (s on the robot's clock).

        Other robots move during the motion and after it; without `begin` they stand still. The check runs forward in
        time.

        Raises:
            Collides: two bodies come nearer than the margin. A pair that is nearer at the start may separate.
            TorqueExceeded: a joint exceeds its torque limit.
        """
        findings = Findings()
        if not (collision or torque):
            return findings
        collision = collision and bool(self.clearance.pairs)
        others = self.others if collision and begin is not None else ()
        begin = begin or 0.0
        until = max([duration, *(other.until - begin for other in others)])
        scene = _Scene(trajectory, duration, begin, until, others)
        floors = np.empty(0)
        # Steps after the end, where the arm is at rest, complete the last interval of the coarse grid.
        count = max(math.ceil(scene.until / self._step - 1e-9), 1)
        count += -count % COARSE
        for first in range(0, count, SEGMENT):
            times = np.arange(first, min(first + SEGMENT, count) + 1) * self._step
            states = scene.sample(times)
            if first == 0 and collision:
                floors = self._floors(states.positions[0])
            if collision:
                self._keep_apart(scene, times, states, floors, findings)
            if torque and times[0] < duration:
                used = self._torques.use(trajectory, times, self._own(states))
                before = findings.torque_use
                findings.torque_use = used if before is None else np.maximum(before, used)
        findings.scope = "all"
        return findings

    def _own(self, states: Samples) -> Samples:
        """Return the arm's part of the states of all joints."""
        parts = states.positions, states.velocities, states.accelerations
        return Samples(*(part[:, : self._joints] for part in parts))

    def _floors(self, start: np.ndarray) -> np.ndarray:
        """Return each pair's smallest allowed distance (P,), m: less than the margin for pairs near at the start."""
        clearance = self.clearance
        floors = np.full(len(clearance.pairs), clearance.margin)
        near = np.flatnonzero(clearance.spheres(start[None])[0] < clearance.margin)
        for pair in near.tolist():
            distance = clearance.distance(pair)
            if distance < clearance.margin:
                floors[pair] = distance - ESCAPE
        return floors

    def _keep_apart(
        self, scene: _Scene, times: np.ndarray, states: Samples, floors: np.ndarray, findings: Findings
    ) -> None:
        """Check for collisions, and update the smallest distance. Raises Collides."""
        clearance, step = self.clearance, times[1] - times[0]
        # A joint that reverses within a step moves a little farther than the difference of its ends.
        turning = np.abs(states.accelerations).max(axis=0) * step**2 / 2
        moved = np.abs(np.diff(states.positions, axis=0)) + turning
        best = findings.nearest.distance if findings.nearest else math.inf
        found = approach(clearance, states.positions, moved, floors, best)
        if found.hit is not None:
            pair, first = found.hit.pair, float(times[0] + found.hit.step * step)
            met = scene.others and clearance.rates[pair, self._joints :].any()
            clear_at = max(other.until for other in scene.others) if met else None
            raise Collides(clearance.pairs[pair], first, self._deepest(pair, scene, first), clearance.margin, clear_at)
        if found.nearest is not None and found.nearest.distance < best:
            near = found.nearest
            when = min(float(times[0] + near.step * step), scene.until)
            findings.nearest = Nearest(near.distance, *clearance.pairs[near.pair].bodies, when)

    def _deepest(self, pair: int, scene: _Scene, first: float) -> float:
        """Return the smallest distance of a pair after an instant, m."""
        distances = []
        for positions in scene.sample(np.linspace(first, max(first, scene.until), AFTER)).positions:
            self.clearance.place(positions)
            distances.append(self.clearance.distance(pair))
        return min(distances)
