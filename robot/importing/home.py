"""Choose the home pose of an arm."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from robot.importing.chain import Arm
from robot.joints import model_ranges
from robot.schema import RobotError
from robot.tree import touching

TRIES = 300
"""Number of random poses that are tried to find one without contact."""
NOT_HOME = 1e-9


@dataclass(frozen=True, slots=True)
class Home:
    """A pose of the whole model.

    Attributes:
        positions: qpos, (nq,), inside the ranges of the arm's and the held joints.
        origin: Origin of the pose, for the TOML.
        notes: Sentences about changes and contacts.
    """

    positions: np.ndarray
    origin: str
    notes: list[str]


def find_home(model: mujoco.MjModel, arm: Arm, keyframe: str | None) -> Home:
    """Return the keyframe's pose, by default that of `home`, else the first; without keyframes, a pose without contact.

    Raises:
        RobotError: there is no such keyframe, or it has a number that is not finite.
    """
    data = mujoco.MjData(model)
    joints = [*arm.joints, *arm.held]
    keys = [model.key(i).name for i in range(model.nkey)]
    if keyframe is not None and keyframe not in keys:
        raise RobotError(f"--home {keyframe}: the model has no such keyframe; it has {', '.join(keys) or 'none'}")
    if keys:
        name = keyframe if keyframe is not None else next((key for key in keys if "home" in key.lower()), keys[0])
        return _of_keyframe(model, data, joints, keys.index(name), name)
    return _free_of_contact(model, data, joints)


def _of_keyframe(model: mujoco.MjModel, data: mujoco.MjData, joints: list[int], key: int, name: str) -> Home:
    pose, wanted = model.key_qpos[key].copy(), model.key_qpos[key].copy()
    addresses = model.jnt_qposadr[joints]
    if not np.isfinite(pose).all():
        raise RobotError(f"keyframe {name!r} has numbers that are not finite; correct them, or choose one with --home")
    pose[addresses] = np.clip(pose[addresses], *model_ranges(model, joints).T)
    notes = [
        f"{model.joint(joint).name}: keyframe {name!r} has {wanted[address]:.6g}, outside of its range; "
        f"home has {pose[address]:.6g}"
        for joint, address in zip(joints, addresses, strict=True)
        if abs(pose[address] - wanted[address]) > NOT_HOME
    ]
    data.qpos[:] = pose
    return Home(pose, f'file: keyframe "{name}"', notes + _contact_notes(model, data, joints))


def _free_of_contact(model: mujoco.MjModel, data: mujoco.MjData, joints: list[int]) -> Home:
    addresses = model.jnt_qposadr[joints]
    first: np.ndarray | None = None
    for origin, values in _candidates(model_ranges(model, joints)):
        data.qpos[:] = model.qpos0
        data.qpos[addresses] = np.clip(np.round(values, 4), *model_ranges(model, joints).T)
        pose = data.qpos.copy()
        first = pose if first is None else first
        if not touching(model, data, set(joints)):
            return Home(pose, origin, [])
    assert first is not None
    data.qpos[:] = first
    return Home(first, "assumed: the middle of the ranges", _contact_notes(model, data, joints))


def _candidates(ranges: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield candidate home poses (J,), the simplest first."""
    bounded = np.where(np.isfinite(ranges), ranges, [-np.pi, np.pi])
    yield "assumed: the middle of the ranges", np.clip(bounded.mean(axis=1), *ranges.T)
    yield "assumed: zero, or the end of the range next to it", np.clip(0.0, *ranges.T)
    random = np.random.default_rng(0)
    for _ in range(TRIES):
        yield "assumed: a pose without contact, found at random", random.uniform(*bounded.T)


def _contact_notes(model: mujoco.MjModel, data: mujoco.MjData, joints: Sequence[int]) -> list[str]:
    return [
        f"at home {first} and {second} overlap by {-distance * 1e3:.1f} mm; volley robot check says what to do"
        for (first, second), distance in touching(model, data, set(joints)).items()
    ]
