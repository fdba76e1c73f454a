"""A stored table of collision-free postures, searched by the racket's position and normal."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from scipy.spatial import KDTree

from robot.clearance import Clearance
from robot.description import RobotConfig
from robot.striking.chain import Chain

COUNT = 20_000
METRES_A_RADIAN = 0.3
"""Weight of a radian, m, in the distance between postures."""
NEAREST = 8
"""Number of postures of the table that are examined for each wanted one."""
INSIDE = 0.02
"""Part of the ranges that is left out at both ends."""


@dataclass(frozen=True, eq=False)
class Reachability:
    """Collision-free postures (n, J) inside the ranges, with the racket's positions and normals, (n, 3)."""

    postures: np.ndarray
    positions: np.ndarray
    normals: np.ndarray

    @staticmethod
    def of(config: RobotConfig, cache: Path | None = None, count: int = COUNT) -> "Reachability":
        """Return the table of a robot: from the folder `cache`, or computed within seconds and stored there."""
        chain = Chain(config)
        file = None if cache is None else cache / f"reachability-{config.name}-{_fingerprint(config, count)}.npy"
        if file is not None and file.is_file():
            postures = np.load(file, allow_pickle=False)
        else:
            postures = _free_postures(config, count)
            if file is not None:
                file.parent.mkdir(parents=True, exist_ok=True)
                partial = file.with_suffix(".part.npy")
                np.save(partial, postures)
                partial.replace(file)
        return Reachability(postures, *chain.pose(postures))

    def seeds(
        self, positions: np.ndarray, normals: np.ndarray, near: np.ndarray, scale: np.ndarray, count: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return seeds (n, count, J), and their distances (n, count), m, from positions and normals (n, 3).

        Of the nearest postures of the table, those nearest to the posture `near` (J,) in units of `scale` are taken.
        """
        distances, index = self._tree.query(np.hstack([positions, METRES_A_RADIAN * normals]), k=NEAREST)
        away = np.linalg.norm((self.postures[index] - near) / scale, axis=2)
        first = np.argsort(away, axis=1)[:, :count]
        return self.postures[np.take_along_axis(index, first, 1)], np.take_along_axis(distances, first, 1)

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(np.hstack([self.positions, METRES_A_RADIAN * self.normals]))


def _free_postures(config: RobotConfig, count: int) -> np.ndarray:
    """Return postures that keep the robot's margin, spread evenly over its ranges; the same in every call."""
    clearance = Clearance(config, config.load_model())
    low, high = np.where(np.isfinite(config.limits.positions), config.limits.positions, [-np.pi, np.pi]).T
    spare = INSIDE * (high - low)
    drawn = np.random.default_rng(0).uniform(low + spare, high - spare, size=(count, config.joint_count))
    return np.array([posture for posture in drawn if _is_free(clearance, posture)]).reshape(-1, config.joint_count)


def _is_free(clearance: Clearance, posture: np.ndarray) -> bool:
    clearance.place(posture)
    return all(clearance.distance(pair) >= clearance.margin for pair in range(len(clearance.pairs)))


def _fingerprint(config: RobotConfig, count: int) -> str:
    """Return a digest of everything on which the table depends."""
    model, found = config.model, hashlib.sha256()
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    ignored = sorted(sorted(pair) for pair in config.collision.ignore)
    rest = config.joint_names, config.tool, config.held, config.collision.margin, ignored, count
    for part in (buffer, config.limits.positions, config.home):
        found.update(part.tobytes())
    found.update(repr(rest).encode())
    return found.hexdigest()[:16]
