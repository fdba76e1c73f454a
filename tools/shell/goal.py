"""`volley goal`: flags become the fields of a goal."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Annotated, Literal, TypeVar

from tyro.conf import arg

from client import GoalFields, executable
from protocol import messages as m
from protocol.codec import encode
from tools.shell import joints
from tools.shell.flags import Coordinates, File, Identifier, Name, Number, Points, Seconds, Switch, ToolPoints, Words
from tools.shell.joints import tool, tool_waypoint
from tools.shell.shell import Shared, Shell, UsageError, reach

Parsed = TypeVar("Parsed")


@dataclass(frozen=True, slots=True)
class GoalFlags:
    """Flags of a goal. Vectors have one word a joint, in the order of `volley description`.

    Attributes:
        primitive: Primitive to imitate; `volley primitives` lists them.
        positions: Joint positions at the goal, rad; by default those of the primitive's end.
        velocities: Joint velocities at the goal, rad/s; by default zero, or without --positions as demonstrated.
        accelerations: Joint accelerations at the goal, rad/s², _ for free; by default free unless at rest.
        tool: Tool position at the goal, X Y Z in m in the world frame, instead of positions and velocities.
        tool_axis: Direction of the tool's z axis at the goal; by default free.
        tool_orientation: Tool orientation at the goal, a quaternion W X Y Z, instead of an axis.
        tool_velocity: Tool velocity at the goal, m/s; by default zero.
        tool_angular_velocity: Tool angular velocity at the goal, rad/s; by default free if --tool-velocity is given.
        duration: Time from the start to the goal, s; by default the demonstration's.
        arrival_time: Time at the goal, s on the robot's clock, instead of a duration.
        fastest: Use the shortest duration inside the limits, instead of a given one.
        alternative: Another allowed end, TIME:POSITIONS:VELOCITIES:ACCELERATIONS, for example 0.8:.2,.5,.8,0,0,0. TIME
            is a duration or, as @12.5, an arrival time. Empty parts are as in the goal. The best imitation is played.
        revises: Correct the motion of this goal_id while it runs, and imitate the rest of its demonstration.
        waypoint: TIME:POSITIONS or TIME:POSITIONS:VELOCITIES, for example 0.5:0.1,_,_,_,_,_ (_ is free).
        tool_waypoint: Tool position on the way, TIME:X,Y,Z; append :AX,AY,AZ for its axis or :W,X,Y,Z for its
            orientation, and :VX,VY,VZ for its velocity.
        limit_positions: Tighter position limits for this goal, LOW:HIGH or _ a joint, rad; one value serves all joints.
        limit_velocities: Tighter velocity limit of each joint, rad/s, or _; one value serves all joints.
        limit_accelerations: Tighter acceleration limit of each joint, rad/s², or _; one value serves all joints.
        limit_jerks: Tighter jerk limit of each joint, rad/s³, or _; one value serves all joints.
        start_positions: With --plan-only: joint positions to plan from, rad, instead of the reference's.
        start_velocities: With --start-positions: joint velocities at the start, rad/s; by default zero.
        start_accelerations: With --start-positions: accelerations at the start, rad/s², _ for free; by default free.
        tolerance: Largest position error of a joint at the hit, rad; beyond it the goal is missed. By default the
            robot's.
        velocity_tolerance: Largest velocity error of a joint at the hit, rad/s; by default the robot's.
        rest_fraction: Final fraction of the duration without acceleration, 0 to 0.99.
        place_time: Deviate from the demonstrated positions only within about this time of both ends, s; by default
            a different start or goal changes the whole motion.
        follow_through: Keep the final velocity this long after the goal, s, at most 0.5.
        no_collision_check: Play the plan even if the arm collides with itself or the scene.
        no_torque_check: Play the plan even if it exceeds the joints' torque limits.
        tail: After the goal: stop inside the limits, or coast (--plan-only).
        method: qp: quadratic program on B-splines; gaussian: the paper's formulation; dmp: a movement primitive.
        goal_id: Name of the motion; by default the planner chooses one.
        client_id: Name of this client, for a lease.
        lease: Stop the arm if this command ends early, and refuse other clients until the motion has ended.
        plan_only: Plan without moving the arm.
        no_preempt: Refuse the goal if another motion runs, instead of replacing that motion.
        wait: Follow the motion to its end and print the result; with --json it is a second line.
        save: Write the planned trajectory to this .msgpack file; with --plan-only, `volley execute` plays it.
    """

    primitive: Name
    positions: Words = ()
    velocities: Words = ()
    accelerations: Words = ()
    tool: Coordinates = ()
    tool_axis: Coordinates = ()
    tool_orientation: Annotated[tuple[str, ...], arg(metavar="W X Y Z", help_behavior_hint="")] = ()
    tool_velocity: Coordinates = ()
    tool_angular_velocity: Coordinates = ()
    duration: Seconds = None
    arrival_time: Seconds = None
    fastest: Switch = False
    alternative: Points = ()
    revises: Identifier = None
    waypoint: Points = ()
    tool_waypoint: ToolPoints = ()
    limit_positions: Words = ()
    limit_velocities: Words = ()
    limit_accelerations: Words = ()
    limit_jerks: Words = ()
    start_positions: Words = ()
    start_velocities: Words = ()
    start_accelerations: Words = ()
    tolerance: Number = None
    velocity_tolerance: Number = None
    rest_fraction: Annotated[float, arg(metavar="X")] = 0.0
    place_time: Seconds = None
    follow_through: Annotated[float, arg(metavar="S")] = 0.0
    no_collision_check: Switch = False
    no_torque_check: Switch = False
    tail: Literal["stop", "coast"] = "stop"
    method: Literal["qp", "gaussian", "dmp"] = "qp"
    goal_id: Identifier = None
    client_id: Annotated[str, arg(metavar="ID", help_behavior_hint="")] = ""
    lease: Switch = False
    plan_only: Switch = False
    no_preempt: Switch = False
    wait: Switch = False
    save: File = None


def goal(flags: Annotated[GoalFlags, arg(name="")], *, shell: Shared) -> int:
    """Play a primitive to its own or another end: `volley goal forehand --positions .17 .47 .86 -.08 0 .1 --wait`.

    Ctrl-C while waiting does not stop the motion, unless it has a lease.
    """
    check(flags)
    with reach(shell, flags.client_id) as link, link.arm.lease() if flags.lease else nullcontext():
        fields = to_fields(flags, lambda: len(link.joint_names()))
        if flags.plan_only:
            reply = link.arm.plan(flags.primitive, **fields)
            _save(flags, reply, link)
            link.print(reply)
            return 0
        motion = link.arm.goal(flags.primitive, **fields)
        _save(flags, motion.reply, link)
        link.print(motion.reply)
        return link.follow(motion) if flags.wait or flags.lease else 0


def check(flags: GoalFlags) -> None:
    """Check the flags that the planner does not receive.

    Raises:
        UsageError: flags contradict each other, or the directory of --save does not exist.
    """
    if (flags.start_velocities or flags.start_accelerations) and not flags.start_positions:
        raise UsageError("--start-velocities and --start-accelerations need --start-positions")
    if flags.plan_only and (flags.wait or flags.lease):
        raise UsageError("--plan-only moves nothing; leave out --wait and --lease")
    if flags.save and not flags.save.parent.is_dir():
        raise UsageError(f"--save {flags.save}: there is no directory {flags.save.parent}")


def to_fields(flags: GoalFlags, count_joints: Callable[[], int]) -> GoalFields:
    """Return the fields of the goal that the flags describe.

    Args:
        flags: Flags of the command.
        count_joints: Asks for the number of joints; called if one value serves all joints.

    Raises:
        UsageError: a word is not a number.
    """
    return GoalFields(
        positions=_given(joints.vector, flags.positions, "--positions"),
        velocities=_given(joints.vector, flags.velocities, "--velocities"),
        accelerations=_given(joints.partial, flags.accelerations, "--accelerations"),
        tool=tool(
            flags.tool,
            flags.tool_orientation,
            flags.tool_axis,
            flags.tool_velocity,
            flags.tool_angular_velocity,
        ),
        duration=flags.duration,
        arrival_time=flags.arrival_time,
        alternatives=[joints.alternative(text) for text in flags.alternative],
        fastest=flags.fastest,
        revises=flags.revises,
        goal_id=flags.goal_id,
        start=_start(flags),
        waypoints=[*map(joints.waypoint, flags.waypoint), *map(tool_waypoint, flags.tool_waypoint)],
        limits=_limits(flags, count_joints),
        tolerance=_tolerance(flags),
        rest_fraction=flags.rest_fraction,
        place_time=flags.place_time,
        follow_through=flags.follow_through,
        checks=m.Checks(collision=not flags.no_collision_check, torque=not flags.no_torque_check),
        tail=flags.tail,
        method=flags.method,
        include_trajectory=flags.save is not None,
        preempt=not flags.no_preempt,
    )


def _save(flags: GoalFlags, reply: m.GoalReply, link: Shell) -> None:
    """Write the trajectory to the file of --save, in the format of `volley execute`."""
    if not flags.save:
        return
    body = encode(executable(reply, link.arm.description().rate_hz))
    try:
        flags.save.write_bytes(body)
    except OSError as error:
        raise UsageError(f"--save {flags.save} cannot be written: {error.strerror}") from None


def _given(parse: Callable[[Sequence[str], str], Parsed], words: Words, flag: str) -> Parsed | None:
    return parse(words, flag) if words else None


def _start(flags: GoalFlags) -> m.Start | None:
    if not flags.start_positions:
        return None
    return m.Start(
        positions=joints.vector(flags.start_positions, "--start-positions"),
        velocities=_given(joints.vector, flags.start_velocities, "--start-velocities"),
        accelerations=_given(joints.partial, flags.start_accelerations, "--start-accelerations"),
    )


def _tolerance(flags: GoalFlags) -> m.Tolerance | None:
    tolerance = m.Tolerance(positions=flags.tolerance, velocities=flags.velocity_tolerance)
    return tolerance if tolerance != m.Tolerance() else None


def _limits(flags: GoalFlags, count_joints: Callable[[], int]) -> m.GoalLimits | None:
    def spread(words: Words) -> Words:
        return words * count_joints() if len(words) == 1 else words

    limits = m.GoalLimits(
        positions=_given(joints.ranges, spread(flags.limit_positions), "--limit-positions"),
        velocities=_given(joints.partial, spread(flags.limit_velocities), "--limit-velocities"),
        accelerations=_given(joints.partial, spread(flags.limit_accelerations), "--limit-accelerations"),
        jerks=_given(joints.partial, spread(flags.limit_jerks), "--limit-jerks"),
    )
    return limits if limits != m.GoalLimits() else None
