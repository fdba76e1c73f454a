"""Find the arm in a model: its tool, the joints from the base to it, and joints to hold."""

import re
from dataclasses import dataclass, field

import mujoco

from robot.model import FREE, SINGLE_AXIS, TOOL_SITE, Tool, body_name
from robot.schema import RobotError
from robot.tree import actuated, carrying_joints, followers, joint_equalities, path_to_world, same_tree, single_axis

TOOL_NAMES = ("attachment_?site", "tcp", "tool0?", "ee|eef|end_?effector", "grip.*", "grasp|pinch", "flange", "hand")
"""Words that name a tool, the most certain first."""
PARTS = re.compile(r"finger|jaw|knuckle|claw", re.IGNORECASE)
"""Words that name parts of a gripper, which are not the tool."""
GRIPPER = re.compile(rf"grip|{PARTS.pattern}", re.IGNORECASE)
"""Words that name a gripper's joints."""


@dataclass(frozen=True, slots=True)
class Arm:
    """The joints of an arm.

    Attributes:
        tool: Frame of the tool.
        tool_origin: Origin of this choice, for the TOML.
        joints: Indices in the model, from the base to the tool.
        held: Indices of joints that are not the arm's and must be held.
        notes: Sentences about decisions.
    """

    tool: Tool
    tool_origin: str
    joints: list[int]
    held: list[int]
    notes: list[str] = field(default_factory=list)


def find_arm(model: mujoco.MjModel, tool: str | None) -> Arm:
    """Return the arm that ends at `tool`, a site or a body; by default at the one with a telling name.

    Raises:
        RobotError: there is no such tool, or no chain of hinges and slides that leads to it from a fixed base.
    """
    frame, origin, notes = _named(model, tool) if tool else _default(model)
    body = int(model.body(frame.body).id if frame.body else model.site_bodyid[model.site(frame.site).id])
    chain = carrying_joints(model, body)
    _check_chain(model, chain)
    names = [model.joint(joint).name for joint in range(model.njnt)]
    while chain and _moves_gripper(model, chain[-1]):
        notes.append(f"{names[chain[-1]]} moves a gripper or follows another joint: it is not a joint of the arm")
        chain.pop()
    if not chain:
        moves = "only a gripper's joints move" if notes else "no joint moves"
        raise RobotError(f"{moves} {tool or frame.body or frame.site!r}; name the last body of an arm with --tool")
    _check_mimics(model, chain, names)
    return Arm(frame, origin, chain, _held_joints(model, chain), notes)


def _named(model: mujoco.MjModel, name: str) -> tuple[Tool, str, list[str]]:
    sites = [model.site(i).name for i in range(model.nsite)]
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    if name in sites:
        return Tool(name), "file: the site that --tool names", []
    if name in bodies:
        return Tool(TOOL_SITE, name), "file: the body that --tool names", []
    raise RobotError(
        f"--tool {name}: the model has no such site or body; "
        f"sites: {', '.join(filter(None, sites)) or 'none'}; bodies: {', '.join(filter(None, bodies))}"
    )


def _default(model: mujoco.MjModel) -> tuple[Tool, str, list[str]]:
    """Return the site, or else the body, with a name of a tool; else the end of the longest chain before a gripper."""
    chains = {body: carrying_joints(model, body) for body in range(model.nbody)}
    depth = {body: len(chain) for body, chain in chains.items()}
    sites = [(model.site(i).name, int(model.site_bodyid[i])) for i in range(model.nsite)]
    bodies = [(model.body(body).name, body) for body in depth]
    for kind, named in (("site", sites), ("body", bodies)):
        ranked = sorted(
            (rank, -len(path_to_world(model, body)), place, name)
            for place, (name, body) in enumerate(named)
            if depth[body] and name and not PARTS.search(name) and (rank := _rank(name)) is not None
        )
        if ranked:
            first, *others = [name for *_, name in ranked]
            tool = Tool(first) if kind == "site" else Tool(TOOL_SITE, first)
            return tool, f"file: the {kind} {first}", [_choice(kind, first, others)] if others else []
    arms = [body for body, chain in chains.items() if chain and not _moves_gripper(model, chain[-1])]
    last = max(arms or depth, key=lambda body: (depth[body], body))
    if not depth[last]:
        raise RobotError("the model has no joints; name the file of an arm, or a scene that includes one")
    if at_the_end := [name for name, body in sites if name and depth[body] == depth[last]]:
        return Tool(at_the_end[0]), "assumed: a site on the last link", [_choice("site", at_the_end[0], at_the_end[1:])]
    name = model.body(last).name
    if not name:
        raise RobotError("the last body has no name; give it one in the model, or name another one with --tool")
    return Tool(TOOL_SITE, name), "assumed: the last body", [f"no name says which the tool is: {name} is the last body"]


def _choice(kind: str, name: str, others: list[str]) -> str:
    more = f", as {', '.join(others[:4])}" if others else ""
    return f"the tool is the {kind} {name}; --tool may name another{more}"


def _rank(name: str) -> int | None:
    """Return the index in TOOL_NAMES of the most certain word in a name, the whole name before its parts."""
    words = [name, *re.split(r"[^a-zA-Z0-9]+|_", name)]
    for rank, pattern in enumerate(TOOL_NAMES):
        for extra, word in enumerate(words):
            if re.fullmatch(pattern, word, re.IGNORECASE):
                return 2 * rank + bool(extra)
    return None


def _moves_gripper(model: mujoco.MjModel, joint: int) -> bool:
    """Return whether a joint follows another one, or its name or its body's says that it moves a gripper."""
    if any(joint == follower for follower, _ in joint_equalities(model)):
        return True
    body = model.body(int(model.jnt_bodyid[joint])).name
    return bool(GRIPPER.search(model.joint(joint).name) or PARTS.search(body))


def _check_chain(model: mujoco.MjModel, chain: list[int]) -> None:
    for joint in chain:
        if model.jnt_type[joint] not in SINGLE_AXIS:
            body = body_name(model, int(model.jnt_bodyid[joint]))
            raise RobotError(
                f"{body} floats freely and carries the arm; remove its free joint, so that the base stands still"
                if model.jnt_type[joint] == FREE
                else f"{body} turns on a ball joint; an arm has hinges and slides, replace it by three hinges"
            )
        if not model.joint(joint).name:
            body = body_name(model, int(model.jnt_bodyid[joint]))
            raise RobotError(f"a joint of {body} has no name; give it one in the model")


def _check_mimics(model: mujoco.MjModel, chain: list[int], names: list[str]) -> None:
    for follower, leader in joint_equalities(model):
        if follower in chain:
            whom = names[leader] if leader >= 0 else "a constant"
            raise RobotError(
                f"{names[follower]} follows {whom} and cannot move by itself; remove <mimic> or the equality, "
                "or name a tool before it with --tool"
            )


def _held_joints(model: mujoco.MjModel, chain: list[int]) -> list[int]:
    """Return the joints that would fall: those in the arm's tree or with an actuator that no equality moves."""
    own = same_tree(model, chain) | actuated(model).intersection(single_axis(model))
    held = own - set(chain) - followers(model)
    return [joint for joint in sorted(held) if model.joint(joint).name]
