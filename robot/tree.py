"""Kinematic tree of a MuJoCo model: which joints move which bodies."""

from collections.abc import Iterator

import mujoco
import numpy as np

from robot.model import SINGLE_AXIS, body_name

CONNECTIONS = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)
JOINT_EQUALITY = int(mujoco.mjtEq.mjEQ_JOINT)
BODY = int(mujoco.mjtObj.mjOBJ_BODY)
SITE = int(mujoco.mjtObj.mjOBJ_SITE)
ROUNDING = 1e-6
"""Largest overlap of bodies that only touch, m."""


def path_to_world(model: mujoco.MjModel, body: int) -> list[int]:
    """Return a body and its ancestors, without the world."""
    path: list[int] = []
    while body:
        path.append(body)
        body = int(model.body_parentid[body])
    return path


def joints_of(model: mujoco.MjModel, body: int) -> range:
    """Return the joints between a body and its parent."""
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body]))


def carrying_joints(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the joints that move a body, from the world to the body."""
    return [joint for link in reversed(path_to_world(model, body)) for joint in joints_of(model, link)]


def is_moved_by(model: mujoco.MjModel, body: int, joints: set[int]) -> bool:
    """Return whether any of the joints moves the body."""
    return not joints.isdisjoint(carrying_joints(model, body))


def single_axis(model: mujoco.MjModel) -> list[int]:
    """Return the hinges and slides."""
    return [joint for joint in range(model.njnt) if model.jnt_type[joint] in SINGLE_AXIS]


def connections(model: mujoco.MjModel) -> Iterator[tuple[int, int, int]]:
    """Yield the active connects and welds: the equality and its two bodies."""
    for equality in range(model.neq):
        if model.eq_type[equality] in CONNECTIONS and model.eq_active0[equality]:
            first, second = (int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality]))
            if model.eq_objtype[equality] == SITE:
                first, second = (int(model.site_bodyid[site]) for site in (first, second))
            yield equality, first, second


def joint_equalities(model: mujoco.MjModel) -> Iterator[tuple[int, int]]:
    """Yield the active joint equalities: the dependent joint, and the joint that drives it (-1: none)."""
    for equality in range(model.neq):
        if model.eq_type[equality] == JOINT_EQUALITY and model.eq_active0[equality]:
            yield int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])


def loop_joints(model: mujoco.MjModel, first: int, second: int) -> set[int]:
    """Return the joints between two bodies: those that move one of them and not the other."""
    return set(carrying_joints(model, first)) ^ set(carrying_joints(model, second))


def same_tree(model: mujoco.MjModel, joints: list[int]) -> set[int]:
    """Return the hinges and slides of the trees, from the world on, that have the joints."""
    roots = {path_to_world(model, int(model.jnt_bodyid[joint]))[-1] for joint in joints}
    return {joint for joint in single_axis(model) if path_to_world(model, int(model.jnt_bodyid[joint]))[-1] in roots}


def actuated(model: mujoco.MjModel) -> set[int]:
    """Return the joints that an actuator drives, directly or through a tendon."""
    driven: set[int] = set()
    for actuator in range(model.nu):
        kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
        if kind in (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)):
            driven.add(target)
        elif kind == int(mujoco.mjtTrn.mjTRN_TENDON):
            first = int(model.tendon_adr[target])
            wraps = range(first, first + int(model.tendon_num[target]))
            driven |= {
                int(model.wrap_objid[i]) for i in wraps if model.wrap_type[i] == int(mujoco.mjtWrap.mjWRAP_JOINT)
            }
    return driven


def followers(model: mujoco.MjModel) -> set[int]:
    """Return the joints that an equality couples to a driven joint, and that need no drive themselves."""
    driven = actuated(model)
    found = {follower for follower, leader in joint_equalities(model) if leader >= 0 and follower not in driven}
    for _, first, second in connections(model):
        loop = loop_joints(model, first, second)
        if not loop.isdisjoint(driven):
            found |= loop - driven
    return found


def touching(model: mujoco.MjModel, data: mujoco.MjData, joints: set[int]) -> dict[tuple[str, str], float]:
    """Return the overlapping pairs of bodies, one of which a joint moves, with their distance (m, negative).

    `data` has the pose; this function computes its contacts. Bodies with a free joint are ignored.
    """
    mujoco.mj_fwdPosition(model, data)
    pairs: dict[tuple[str, str], float] = {}
    for index, geoms in enumerate(data.contact.geom.tolist()):
        bodies = [int(model.geom_bodyid[geom]) for geom in geoms]
        if any(flies(model, body) for body in bodies):
            continue
        if any(is_moved_by(model, body, joints) for body in bodies):
            names = sorted(body_name(model, body) for body in bodies)
            pair = names[0], names[1]
            pairs[pair] = min(pairs.get(pair, np.inf), float(data.contact.dist[index]))
    return {pair: distance for pair, distance in pairs.items() if distance < -ROUNDING}


def flies(model: mujoco.MjModel, body: int) -> bool:
    """Return whether the body or an ancestor has a free joint."""
    free = int(mujoco.mjtJoint.mjJNT_FREE)
    return any(model.jnt_type[joint] == free for joint in carrying_joints(model, body))
