"""`volley goal`: from flags to the fields of a goal."""

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
from tools.shell.following import follow
from tools.shell.shell import Shared, Shell, UsageError, reach
from tools.shell.tool import tool, tool_waypoint

Parsed = TypeVar("Parsed")


@dataclass(frozen=True, slots=True)
class GoalFlags:
    """Flags of a goal. Vectors have one word a joint, in the order that `description` prints.

    Attributes:
        primitive: What to imitate; `primitives` lists them.
        positions: Where the joints end, rad; by default where the primitive ends.
        velocities: With which velocity they end, rad/s; by default zero, or without --positions as demonstrated.
        accelerations: With which acceleration they end, rad/s², _ for free; by default free unless at rest.
        tool: Where the tool ends, X Y Z in m in the world frame, instead of positions and velocities.
        tool_axis: Direction in which its z axis points; by default any.
        tool_orientation: Its orientation, a quaternion W X Y Z, instead of an axis.
        tool_velocity: With which velocity it ends, m/s; by default zero.
        tool_angular_velocity: With which angular velocity, rad/s; by default any beside a velocity.
        duration: From the start to the goal, s; by default as long as the demonstration.
        arrival_time: When to be at the goal, s on the robot's clock, instead of a duration.
        fastest: As fast as the limits allow, instead of a duration.
        alternative: A further end, TIME:POSITIONS:VELOCITIES:ACCELERATIONS, as 0.8:.2,.5,.8,0,0,0; TIME is a duration
            or an arrival time as @12.5, and what is empty is as in the goal. The end that imitates best is played.
        revises: Correct the motion of this goal_id, which is under way, and imitate what is left of it.
        waypoint: A place on the way, TIME:POSITIONS or TIME:POSITIONS:VELOCITIES, as 0.5:0.1,_,_,_,_,_ (_ is free).
        tool_waypoint: A place of the tool on the way, TIME:X,Y,Z; behind it :AX,AY,AZ for its axis or :W,X,Y,Z for its
            orientation, and :VX,VY,VZ for its velocity.
        limit_positions: Tighter limits for this goal, LOW:HIGH or _ a joint, rad; a single one is for all joints.
        limit_velocities: Largest velocity a joint, rad/s, or _; a single one is for all joints.
        limit_accelerations: Largest acceleration a joint, rad/s², or _; a single one is for all joints.
        limit_jerks: Largest jerk a joint, rad/s³, or _; a single one is for all joints.
        start_positions: With --plan-only: plan from here, rad, instead of where the arm will be.
        start_velocities: With --start-positions: the velocity there, rad/s; by default zero.
        start_accelerations: With --start-positions: the acceleration there, rad/s², _ for free; by default free.
        tolerance: Largest position error of a joint at the hit, rad; a larger one is a miss. By default the robot's.
        velocity_tolerance: The same for velocities, rad/s.
        rest_fraction: Final part of the duration without acceleration, 0 to 0.99.
        place_time: Keep the demonstrated places but for about this long at both ends, s; by default a start or goal
            that differs moves all of them.
        follow_through: Keep the final velocity this long after the goal, s, at most 0.5.
        no_collision_check: Play it even where the arm meets itself or the scene.
        no_torque_check: Play it even where it needs more torque than the joints have.
        tail: After the goal: stop inside the limits, or coast on (--plan-only).
        method: The quadratic program, the same as the paper has it, or the movement primitive both are compared with.
        goal_id: Name of the motion; by default the planner makes one.
        client_id: Your name, for a lease.
        lease: Stop the arm when this command ends early, and keep other clients away until the motion has ended.
        plan_only: Plan, and move nothing.
        no_preempt: Be refused instead of taking the place of a motion that runs.
        wait: Follow the motion to its end and print the result.
        save: Write the planned trajectory to this .msgpack file; with --plan-only it is for `execute`.
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
    """Play a primitive to its own end, or to another: `volley goal forehand --positions .17 .47 .86 -.08 0 .1 --wait`.

    Ctrl-C while waiting leaves the motion running, unless it has a lease.
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
        return follow(link, motion) if flags.wait or flags.lease else 0


def check(flags: GoalFlags) -> None:
    """Check what the planner cannot: flags that do not reach it.

    Raises:
        UsageError: they contradict each other, or --save names a directory that is not there.
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
        flags: As given.
        count_joints: Asks how many joints the arm has, where one word stands for all of them.

    Raises:
        UsageError: a word that is no number.
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
    """Write the trajectory where --save says, as `execute` takes it."""
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
