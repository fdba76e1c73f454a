"""`python -m benchmarks.space ROBOT.toml …`: the check of plans for collisions and torques, compared with a replay.

Random plans of a robot are checked and replayed. The replay computes the distance of every pair of geoms and every
torque at every millisecond; unlike the check it has no bound of the motion between two instants. Times are processor
times. Results are saved after every part; with `--resume` a run adds to the saved results, until there are enough.
"""

import json
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, fields
from itertools import islice
from pathlib import Path
from typing import Annotated

import mujoco
import numpy as np
import tyro

from benchmarks.machine import RESULTS, save
from benchmarks.timing import milliseconds
from motion.demonstration import Demonstration
from motion.errors import MotionError
from motion.plan import Plan, plan
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest
from robot.clearance import Clearance
from robot.description import RobotConfig, load_robot
from robot.motion_check import Collides, MotionCheck
from robot.torque_check import TorqueExceeded
from robot.torques import InverseDynamics

REPLAY_S = 1e-3
FINER = 16
"""Number of instants a millisecond in a replay where the check found a violation between two milliseconds."""

PART = 100
"""Number of plans with one seed."""

REACH = 1.5
"""Largest distance of ends from starts, rad, on each joint."""


@dataclass
class Found:
    """Results of the check, compared with the replay.

    free: accepted plans. collisions, torques: refused plans. missed: accepted plans with a contact, or a torque above
    its limit, in the replay. wrong: refused plans with more than the margin, or inside all torque limits. inside:
    accepted plans nearer than the margin at some millisecond; deepest: largest shortfall, m. overestimated: largest
    excess of the smallest distance in a report, m. seconds: of each accepted plan's check.
    """

    free: int = 0
    collisions: int = 0
    torques: int = 0
    missed: int = 0
    wrong: int = 0
    inside: int = 0
    deepest: float = 0.0
    overestimated: float = 0.0
    seconds: list[float] = field(default_factory=list)


class Replay:
    """Distances and torques of a robot at every instant, with its own models and data."""

    def __init__(self, config: RobotConfig) -> None:
        self._model = model = config.load_model()
        self._clearance = clearance = Clearance(config, model)
        self._geoms = np.array([geoms for pair in clearance.pairs for geoms in pair.geoms]).reshape(-1, 2)
        self._dynamics = InverseDynamics(config, config.load_model())
        self._limits = config.torques
        reach = model.geom_rbound.copy()
        reach[model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)] = np.inf
        self._reach = reach[self._geoms].sum(axis=1)

    def distance(self, plan: Plan, far: float, step: float = REPLAY_S) -> float:
        """Return the smallest distance along a plan, m; at most `far`."""
        clearance, nearest = self._clearance, far
        motion = plan.sample(np.arange(0, plan.total_duration + step / 2, step)).positions
        centres = np.empty((len(motion), self._model.ngeom, 3))
        for index, positions in enumerate(motion):
            clearance.place(positions)
            centres[index] = clearance.data.geom_xpos
        # Pairs of geoms with separate bounding spheres need no exact distance.
        apart = np.linalg.norm(np.subtract(*(centres[:, side] for side in self._geoms.T)), axis=2) - self._reach
        for index in np.flatnonzero((apart < far).any(axis=1)).tolist():
            clearance.place(motion[index])
            for geoms in self._geoms[apart[index] < nearest].tolist():
                nearest = min(nearest, mujoco.mj_geomDistance(self._model, clearance.data, *geoms, nearest, None))
        return nearest

    def torque_use(self, plan: Plan) -> float:
        """Return the largest part of a torque limit along a plan."""
        samples = plan.sample(np.arange(0, plan.total_duration + REPLAY_S / 2, REPLAY_S))
        states = zip(samples.positions, samples.velocities, samples.accelerations, strict=True)
        return max(float((np.abs(self._dynamics.torques(*state)) / self._limits).max()) for state in states)


def random_plans(config: RobotConfig, seed: int) -> Iterator[Plan]:
    """Yield plans from random starts at rest to random ends, at rest or moving, as the limits allow."""
    rng = np.random.default_rng(seed)
    primitive = _reach(config.joint_count)
    ranges = np.clip(config.limits.positions, -np.pi, np.pi)
    while True:
        start = rng.uniform(*ranges.T)
        end = np.clip(start + rng.uniform(-REACH, REACH, len(start)), *ranges.T)
        nothing, free = np.zeros(len(start)), np.full(len(start), np.nan)
        moving = rng.uniform(-1, 1, len(start)) if rng.uniform() < 0.5 else nothing
        begin, goal = Boundary(start, nothing, nothing), Boundary(end, moving, free)
        request = MotionRequest(begin, goal, round(float(rng.uniform(0.5, 3.0)), 3), config.limits)
        try:
            yield plan(primitive, request, config.tick, remedy=False, thorough=False)
        except MotionError:
            continue


def compare(config: RobotConfig, plans: int, seed: int = 0, found: Found | None = None) -> Found:
    """Check and replay random plans that begin without collisions; add the results to those `found` before."""
    motions, replay, found = MotionCheck(config), Replay(config), found or Found()
    margin = config.collision.margin
    for motion in islice(_clear(motions.clearance, random_plans(config, seed)), plans):
        began = time.thread_time()
        try:
            report = motions.check(motion.trajectory, motion.total_duration)
        except Collides:
            found.collisions += 1
            clear = replay.distance(motion, 2 * margin) > margin
            found.wrong += clear and replay.distance(motion, 2 * margin, REPLAY_S / FINER) > margin
        except TorqueExceeded:
            found.torques += 1
            found.wrong += replay.torque_use(motion) <= 1
        else:
            found.seconds.append(time.thread_time() - began)
            found.free += 1
            far = report.nearest.distance if report.nearest else 2 * margin
            distance = replay.distance(motion, far)
            found.missed += distance <= 0 or replay.torque_use(motion) > 1
            found.inside += distance < margin
            found.deepest = max(found.deepest, margin - distance)
            found.overestimated = max(found.overestimated, far - distance)
    return found


def _clear(clearance: Clearance, motions: Iterator[Plan]) -> Iterator[Plan]:
    """Yield the motions that begin without collisions."""
    for motion in motions:
        clearance.place(motion.request.start.positions)
        if all(clearance.distance(pair) > clearance.margin for pair in range(len(clearance.pairs))):
            yield motion


def _reach(joints: int) -> Primitive:
    """A smooth motion of all joints by 1 rad in 1 s."""
    times = np.linspace(0, 1, 201)
    shape = times**3 * (10 - 15 * times + 6 * times**2)
    return learn(Demonstration(times, np.repeat(shape[:, None], joints, axis=1)))


def main(
    robots: Annotated[list[Path], tyro.conf.Positional], plans: int = 10_000, seed: int = 0, resume: bool = False
) -> None:
    """Compare, print and save.

    Args:
        robots: TOML files of robots.
        plans: Number of plans of each robot, including resumed ones.
        seed: Of the first part of the random plans; each further part uses the next seed.
        resume: Continue after the plans with saved results; times are those of the new plans.
    """
    rows = json.loads((RESULTS / "space.json").read_text())["results"] if resume else {}
    for path in robots:
        config, row = load_robot(path), rows.get(path.stem, {"next_seed": seed})
        found = Found(**{entry.name: row[entry.name] for entry in fields(Found) if entry.name in row})
        while (missing := plans - found.free - found.collisions - found.torques) > 0:
            compare(config, min(PART, missing), row["next_seed"], found)
            row = asdict(found) | {"next_seed": row["next_seed"] + 1}
            rows[path.stem] = row | {"check": milliseconds(row.pop("seconds"))}
            print(path.stem, rows[path.stem], flush=True)
            save("space", rows)


if __name__ == "__main__":
    tyro.cli(main)
