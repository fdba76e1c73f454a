"""Whether a motion collides, and whether it needs more torque than the arm has."""

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
"""Instants at which a motion is looked at are multiples of this, or of the robot's tick if that is longer."""

SEGMENT = 32 * COARSE
"""Steps that are checked for collisions, then for torques, before those that follow."""

ESCAPE = 1e-3
"""Bodies that are nearer than the margin when a motion begins may come this much (m) nearer still."""

AFTER = 200
"""Number of instants after a collision at which the distance of the two bodies is measured, for the smallest one."""

Scope = Literal["all", "none"]


class Collides(MotionError):
    """Two bodies come nearer to each other than the margin.

    `time` (s from the start) is the first such instant, `distance` (m) the smallest distance of the two after it,
    negative: how deep they are in each other.
    """

    def __init__(self, pair: Pair, time: float, distance: float, margin: float, clear_at: float | None = None) -> None:
        """Describe it; `clear_at`: when (s on the robot's clock) the other robot of the pair has ended its motion."""
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
    """The smallest distance (m) that was measured along a motion, of which bodies, and when (s from its start)."""

    distance: float
    body: str
    other: str
    time: float


@dataclass(slots=True)
class Findings:
    """What a check found out.

    nearest: None where nothing can meet, or nothing was looked at. torque_use: (J,), largest part of each joint's
    torque limit, NaN where it has none; None where it was not looked at. scope: whether anything was looked at.
    """

    nearest: Nearest | None = None
    torque_use: np.ndarray | None = None
    scope: Scope = "none"


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """A motion beside those of the other robots.

    duration: of the motion, s. begin: of the motion, s on the robot's clock. until: when all are at rest, s from its
    begin.
    """

    trajectory: Trajectory
    duration: float
    begin: float
    until: float
    others: tuple[OtherMotion, ...]

    def sample(self, times: np.ndarray) -> Samples:
        """Return the states of the arm's joints and then the others', (n, J + O), at times (n,), s from the begin."""
        own = self.trajectory.sample(np.minimum(times, self.duration))
        if not self.others:
            return own
        states = [np.array([own.positions, own.velocities, own.accelerations])]
        states += [other.sample(self.begin + times) for other in self.others]
        return Samples(*np.concatenate(states, axis=2))


class MotionCheck:
    """Checks motions of one robot, along all of their way and their stop. It holds its own data: use one a thread.

    others: the motions of the other robots that stand in the model, in the order of the robot's TOML; none where none
    of them moves: they then stand where `clearance` has them.
    """

    def __init__(self, config: RobotConfig) -> None:
        model = config.load_model()
        self.clearance = Clearance(config, model)
        self.others: tuple[OtherMotion, ...] = ()
        self._joints = config.joint_count
        self._torques = TorqueCheck(config, model)
        # A multiple of the tick, or a part of it, so that the arm passes through the steps.
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

        Other robots move meanwhile, and after it; where `begin` is None they stand. What comes first is checked first.

        Raises:
            Collides: two bodies come nearer than the margin. A pair that is nearer at the start may part.
            TorqueExceeded: a joint needs more torque than it has.
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
        # Steps beyond the end, where the arm is at rest, make whole intervals of the coarse grid.
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
        """Return the smallest distance (m) that each pair may have, (P,): less than the margin for those near now."""
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
        """Look for collisions, and note the smallest distance. Raises Collides."""
        clearance, step = self.clearance, times[1] - times[0]
        # A joint that turns round within a step goes a little farther than from one to the other.
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
        """Return the smallest distance of a pair from an instant on, m."""
        distances = []
        for positions in scene.sample(np.linspace(first, max(first, scene.until), AFTER)).positions:
            self.clearance.place(positions)
            distances.append(self.clearance.distance(pair))
        return min(distances)
