"""Distances between the arm's bodies, and to the bodies around it."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from math import dist
from typing import Literal, get_args

import mujoco
import numpy as np

from robot.court import TEE
from robot.description import RobotConfig
from robot.levers import PLANE, Levers
from robot.model import addresses, body_name, joint_ids, owner_name
from robot.tree import flies, is_moved_by, path_to_world

FAR = 1.0
"""Largest distance that is measured, m; larger ones are returned as this."""

ROUGH = 0.2
"""Distance (m) beyond which that of the bounding spheres is precise enough."""

UNMEASURED = int(mujoco.mjtGeom.mjGEOM_HFIELD), int(mujoco.mjtGeom.mjGEOM_SDF)
"""Height fields and signed distance fields: MuJoCo finds their contacts, but computes no true distance."""

Reason = Literal["neighbours", "near at home", "collision.ignore"]
REASONS: tuple[Reason, ...] = get_args(Reason)


@dataclass(frozen=True, slots=True)
class Ignored:
    """Two bodies that are not checked for collisions, and the reason."""

    body: str
    other: str
    reason: Reason


@dataclass(frozen=True, slots=True)
class Pair:
    """Two bodies that could collide.

    bodies: their names, first that of the one that the arm moves; for the world the geom's name. geoms: pairs of geoms
    that could touch. rates: (J + O,), bound of the decrease of their distance per unit of each joint, first the arm's
    joints, then other robots'. centres: one geom of each body. reach: sum of the radii of the bodies' bounding spheres
    around these, m.
    """

    bodies: tuple[str, str]
    geoms: tuple[tuple[int, int], ...]
    rates: np.ndarray
    centres: tuple[int, int]
    reach: float


class Clearance:
    """Pairs of bodies that could collide, and their distances at a pose. Not thread-safe: use one a thread.

    MuJoCo's filter (`contype`, `conaffinity`, `<exclude>`) decides which geoms can touch. A pair is checked if the
    arm's joints change its distance. Excepted are neighbours (a body and its parent; welded bodies count as one),
    pairs that are nearer than the margin at home, and pairs that the robot's TOML ignores. The world body is no
    neighbour, and each of its geoms makes a separate pair. Bodies with a free joint, the tee and `UNMEASURED` geoms
    are not checked. Other mocap bodies, also the base's, stay at their pose in the model. Held joints have the values
    of the TOML until `surround` moves them; all other joints stay as in the model.

    margin: m. ignored: pairs that are not checked. rates: (P, J + O), those of all pairs.
    """

    def __init__(self, config: RobotConfig, model: mujoco.MjModel) -> None:
        self.model = model
        self.margin = config.collision.margin
        self.data = mujoco.MjData(model)
        self._positions_of = self.data.geom_xpos
        joints = joint_ids(model, config.joint_names)
        others = joint_ids(model, tuple(chain.from_iterable(config.others.values())))
        # Addresses by the number of given joint positions: the arm's, or also the other robots'.
        moved = joints, joints + others
        self._qpos = {len(placed): addresses(model.jnt_qposadr[placed]) for placed in moved}
        self._addresses: dict[tuple[str, ...], np.ndarray] = {}
        self.data.qpos[:] = config.pose_at_home
        self.pairs, self.ignored = _candidates(model, joints, others)
        self.place(config.home)
        kept, ignore = [], config.collision.ignore
        for index, pair in enumerate(self.pairs):
            if frozenset(body_name(model, int(model.geom_bodyid[geom])) for geom in pair.geoms[0]) in ignore:
                self.ignored.append(Ignored(*pair.bodies, "collision.ignore"))
            elif self.distance(index) < self.margin:
                self.ignored.append(Ignored(*pair.bodies, "near at home"))
            else:
                kept.append(pair)
        self.pairs = kept
        self.rates = np.array([pair.rates for pair in kept]).reshape(len(kept), len(joints + others))
        self._centres = np.array([pair.centres for pair in kept], dtype=np.intp).reshape(len(kept), 2)
        self._reach = np.array([pair.reach for pair in kept])

    def __str__(self) -> str:
        """Describe the pairs that are checked, and those that are not with the reason."""
        of = {reason: [f"{i.body} – {i.other}" for i in self.ignored if i.reason == reason] for reason in REASONS}
        left_out = "; ".join(f"{reason}: {', '.join(pairs)}" for reason, pairs in of.items() if pairs) or "none"
        return (
            f"plans keep {self.margin:g} m between {len(self.pairs)} pairs of bodies; pairs not looked at: {left_out}"
        )

    def place(self, positions: np.ndarray) -> None:
        """Set the arm's joint positions (J,), or those of the arm and the other robots (J + O,)."""
        self.data.qpos[self._qpos[len(positions)]] = positions
        mujoco.mj_kinematics(self.model, self.data)

    def spheres(self, positions: np.ndarray) -> np.ndarray:
        """Return a lower bound of each pair's distance at n poses, (n, P), m, from bounding spheres.

        It is -inf for geoms without a bounding sphere.
        """
        placed = np.empty((len(positions), *self._positions_of.shape))
        for row, pose in enumerate(positions):
            self.place(pose)
            placed[row] = self._positions_of
        between = placed[:, self._centres[:, 0]] - placed[:, self._centres[:, 1]]
        return np.sqrt(np.einsum("npx,npx->np", between, between)) - self._reach

    def surround(self, joints: tuple[str, ...], positions: Sequence[float]) -> None:
        """Set the positions of joints that are not the arm's: held ones, or another robot's; rad or m."""
        if joints not in self._addresses:
            found = joint_ids(self.model, joints, "others")
            self._addresses[joints] = np.array([self.model.jnt_qposadr[joint] for joint in found], dtype=np.intp)
        self.data.qpos[self._addresses[joints]] = positions

    def distance(self, index: int) -> float:
        """Return the distance of a pair at the pose that was set, m; negative: penetration depth.

        Above `ROUGH` it is a lower bound.
        """
        pair, centres = self.pairs[index], self._positions_of
        apart = dist(centres[pair.centres[0]], centres[pair.centres[1]]) - pair.reach
        if apart > ROUGH:
            return apart
        nearest = FAR
        for one, other in pair.geoms:
            nearest = min(nearest, mujoco.mj_geomDistance(self.model, self.data, one, other, nearest, None))
        return nearest


def _candidates(model: mujoco.MjModel, joints: list[int], others: list[int]) -> tuple[list[Pair], list[Ignored]]:
    """Return the pairs whose distance the arm's joints change, and the neighbours among them."""
    levers = Levers(model)
    excluded = {frozenset(divmod(int(signature), 1 << 16)) for signature in model.exclude_signature}
    found: defaultdict[tuple[int, int], list[tuple[int, int]]] = defaultdict(list)
    ignored: dict[frozenset[int], Ignored] = {}
    measured = np.flatnonzero(~np.isin(model.geom_type, UNMEASURED)).tolist()
    geoms = [geom for geom in measured if not _loose(model, int(model.geom_bodyid[geom]))]
    for index, one in enumerate(geoms):
        for other in geoms[index + 1 :]:
            bodies = int(model.geom_bodyid[one]), int(model.geom_bodyid[other])
            if not _can_touch(model, one, other) or frozenset(bodies) in excluded:
                continue
            if not levers.between(one, other, joints).any():
                continue
            if _neighbours(model, *bodies):
                ignored[frozenset(bodies)] = Ignored(*_names(model, (one, other), joints), "neighbours")
                continue
            keys = (bodies[0] or -1 - one), (bodies[1] or -1 - other)
            found[keys].append((one, other))
    pairs = [_pair(model, levers, tuple(geoms), joints, others) for geoms in found.values()]
    return pairs, list(ignored.values())


def _pair(
    model: mujoco.MjModel, levers: Levers, geoms: tuple[tuple[int, int], ...], joints: list[int], others: list[int]
) -> Pair:
    rates = np.max([levers.between(one, other, joints + others) for one, other in geoms], axis=0)
    reach = sum(max(_reach(model, pair[side], geoms[0][side]) for pair in geoms) for side in range(2))
    return Pair(_names(model, geoms[0], joints), geoms, rates, geoms[0], reach)


def _names(model: mujoco.MjModel, geoms: tuple[int, int], joints: list[int]) -> tuple[str, str]:
    """Return the names of two geoms' bodies, first that of the body later in the chain, which the arm moves farther.

    For the world it is the geom's name, as in contact messages.
    """

    def farther(geom: int) -> tuple[bool, int]:
        body = int(model.geom_bodyid[geom])
        return is_moved_by(model, body, set(joints)), body

    first, second = sorted(geoms, key=farther, reverse=True)
    return owner_name(model, first), owner_name(model, second)


def _reach(model: mujoco.MjModel, geom: int, centre: int) -> float:
    """Return the largest distance of a geom's points from the centre of another geom of its body, m."""
    if model.geom_type[geom] == PLANE:
        return float("inf")
    return float(np.linalg.norm(model.geom_pos[geom] - model.geom_pos[centre]) + model.geom_rbound[geom])


def _can_touch(model: mujoco.MjModel, one: int, other: int) -> bool:
    types, affinities = model.geom_contype, model.geom_conaffinity
    return bool(types[one] & affinities[other] | types[other] & affinities[one])


def _loose(model: mujoco.MjModel, body: int) -> bool:
    """Return whether the simulation moves the body beside the joints: it flies, or is the tee."""
    return flies(model, body) or any(model.body(part).name == TEE for part in path_to_world(model, body))


def _neighbours(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Return whether a joint connects the bodies, or what they are welded to; the world is nobody's neighbour."""
    welds = [_welded(model, body) for body in (one, other)]
    parents = [_welded(model, int(model.body_parentid[weld])) for weld in welds]
    return (parents[0] == welds[1] != 0) or (parents[1] == welds[0] != 0)


def _welded(model: mujoco.MjModel, body: int) -> int:
    """Return the first of the bodies without a joint between them; bodies on the world are not part of it."""
    while body and not model.body_jntnum[body] and model.body_parentid[body]:
        body = int(model.body_parentid[body])
    return body
