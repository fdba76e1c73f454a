"""Checks of a model's structure: contacts, equalities, joints, names."""

from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np

from motion.listing import listed
from robot.checking.subject import Finding, Subject
from robot.clearance import UNMEASURED, Clearance
from robot.model import body_name, owner_name
from robot.schema import CollisionTable
from robot.tree import (
    actuated,
    carrying_joints,
    connections,
    is_moved_by,
    joint_equalities,
    loop_joints,
    same_tree,
    touching,
)

DEEP = 1e-3
"""Overlap (m) above which two bodies push each other apart."""
LISTED = 4


def contacts_at_home(subject: Subject) -> Iterator[Finding]:
    """Find bodies of the arm that overlap others at home."""
    data = mujoco.MjData(subject.model)
    data.qpos[:] = subject.config.pose_at_home
    for (first, second), distance in touching(subject.model, data, {*subject.joints, *subject.held}).items():
        if frozenset((first, second)) not in subject.config.collision.ignore or distance < -DEEP:
            exclude = f'add to the model <contact><exclude body1="{first}" body2="{second}"/></contact>'
            always = "remove one <collision>" if subject.config.urdf else exclude
            pose = "home" if subject.config.bodies.intersection((first, second)) else "[held]"
            yield Finding(
                "unusable" if distance < -DEEP else "warning",
                f"at home {first} and {second} overlap by {-distance * 1e3:.3g} mm and push each other off; "
                f"change {pose}, or where they always overlap, {always}",
            )


def restraints(subject: Subject) -> Iterator[Finding]:
    """Find equalities that obstruct the arm's motion."""
    model, arm = subject.model, set(subject.joints)
    for equality, first, second in connections(model):
        if stopped := loop_joints(model, first, second) & arm:
            kind = "weld" if model.eq_type[equality] == int(mujoco.mjtEq.mjEQ_WELD) else "connect"
            yield Finding(
                "unusable",
                f"a {kind} of {body_name(model, first)} to {body_name(model, second)} works against "
                f'{_listed(subject, stopped)}; remove it from <equality>, or write active="false"',
            )
    for follower, leader in joint_equalities(model):
        if caught := {follower, leader} & arm:
            other = "a constant" if leader < 0 else _listed(subject, {follower, leader} - caught or {leader})
            yield Finding(
                "unusable",
                f"an equality or <mimic> couples {_listed(subject, caught)} to {other}, but the planner moves it by "
                "itself; remove it, or leave the joint out of joints.names",
            )


def undriven(subject: Subject) -> Iterator[Finding]:
    """Find joints that are neither driven nor held, and fall."""
    model = subject.model
    driven = {*subject.joints, *subject.held}
    tool = int(model.site_bodyid[model.site(subject.config.tool.site).id])
    inside = [joint for joint in carrying_joints(model, tool) if joint not in driven | subject.followers]
    for joint in inside:
        yield Finding(
            "unusable",
            f"{subject.joint_name(joint)} carries the tool, but is neither in joints.names nor in [held]: it falls; "
            "add it to one of them, or remove it from the model",
        )
    limp = (same_tree(model, subject.joints) | actuated(model)) - driven - subject.followers - set(inside)
    if limp:
        name = model.joint(min(limp)).name
        named = f"add them to [held], as {name} = 0.0" if name else "name them in the model, and add them to [held]"
        yield Finding("warning", f"nobody drives or holds {_listed(subject, limp)}: they hang limp; {named}")


def order(subject: Subject) -> Iterator[Finding]:
    """Find names that are not in chain order."""
    model, joints = subject.model, subject.joints
    for place, joint in enumerate(joints):
        chain = carrying_joints(model, int(model.jnt_bodyid[joint]))
        before = chain[: chain.index(joint)]
        if later := [other for other in joints[place + 1 :] if other in before]:
            yield Finding(
                "warning",
                f"joints.names: {subject.joint_name(joint)} stands before {subject.joint_name(later[0])}, which "
                "carries it; vectors and recordings have this order, so write the names from the base to the tool",
            )
            return


def urdf_limits(subject: Subject) -> Iterator[Finding]:
    """Find implausible limits in a URDF."""
    yield from (Finding("warning", doubt) for joint in subject.config.urdf.values() for doubt in joint.doubts)


def unnamed_bodies(subject: Subject) -> Iterator[Finding]:
    """Find bodies without a name, which no message can name."""
    model = subject.model
    arm = set(subject.joints)
    unnamed = [body for body in range(1, model.nbody) if not model.body(body).name and is_moved_by(model, body, arm)]
    if unnamed:
        numbers = ", ".join(map(str, unnamed[:LISTED]))
        yield Finding(
            "warning", f"{len(unnamed)} bodies of the arm have no name (body {numbers}); name them in the model"
        )


def shapes(subject: Subject) -> Iterator[Finding]:
    """Find arms without collision geometry, and shapes whose distances MuJoCo does not compute."""
    model, arm = subject.model, set(subject.joints)
    solid = np.flatnonzero(model.geom_contype | model.geom_conaffinity).tolist()
    for geom in solid:
        if model.geom_type[geom] in UNMEASURED:
            yield Finding(
                "warning",
                f"plans are not checked against the height or distance field of {owner_name(model, geom)}, whose "
                "distances MuJoCo does not compute; add boxes or meshes in its place",
            )
    links = {int(model.body_weldid[body]) for body in range(1, model.nbody) if is_moved_by(model, body, arm)}
    bare = sorted(links - {int(model.body_weldid[model.geom_bodyid[geom]]) for geom in solid})
    if bare:
        which = ", ".join(body_name(model, body) for body in bare[:LISTED]) + (", …" if len(bare) > LISTED else "")
        yield Finding(
            "warning",
            f"{'no link of the arm has' if len(bare) == len(links) else 'links without'} collision geometry: {which}; "
            "their contacts are neither simulated nor planned around; add <collision> (URDF) or geoms with contype 1 "
            "(MJCF)",
        )


def margin(subject: Subject) -> Iterator[Finding]:
    """Find a margin that excludes bodies from the check of plans which stand apart at home."""
    own, usual = subject.config.collision, CollisionTable().margin
    if own.margin <= usual:
        return
    excluded = _near_at_home(subject, own.margin) - _near_at_home(subject, usual)
    if excluded:
        pairs = ", ".join(sorted(f"{one} – {other}" for one, other in excluded))
        yield Finding(
            "warning",
            f"collision.margin: these bodies are nearer than {own.margin:g} m at home, so no plan is checked for them: "
            f"{pairs}; choose a smaller margin (m) or another home",
        )


def _near_at_home(subject: Subject, margin: float) -> set[tuple[str, str]]:
    """Return the pairs of bodies that plans may bring together because they are nearer than `margin` at home."""
    collision = replace(subject.config.collision, margin=margin)
    clearance = Clearance(replace(subject.config, collision=collision), subject.model)
    return {(pair.body, pair.other) for pair in clearance.ignored if pair.reason == "near at home"}


def _listed(subject: Subject, joints: set[int]) -> str:
    return listed([subject.joint_name(joint) for joint in sorted(joints)], LISTED)
