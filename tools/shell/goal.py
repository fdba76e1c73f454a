"""`client goal`: from flags to a Goal, and following the motion to its end."""

import math
import sys
import time
import uuid
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from msgspec.structs import replace
from tyro.conf import Positional, UseAppendAction, arg

from protocol import messages as m
from protocol.codec import encode
from protocol.topics import GOAL, RESULT
from tools.shell import joints
from tools.shell.shell import Shared, Shell, UsageError, reach

POLL_S = 0.1
ROUNDING = 1e-6
"""Of a tick."""
Parsed = TypeVar("Parsed")
Words = Annotated[tuple[str, ...], arg(metavar="NUMBER ...")]


@dataclass(frozen=True, slots=True)
class GoalFlags:
    """Flags of a goal. Vectors have one word a joint, in the order that `description` prints.

    Attributes:
        primitive: What to imitate; `primitives` lists them.
        positions: Where the joints end, rad; by default where the primitive ends.
        velocities: With which velocity they end, rad/s; by default zero, or without --positions as demonstrated.
        accelerations: With which acceleration they end, rad/s², _ for free; by default free unless at rest.
        duration: From the start to the goal, s; by default as long as the demonstration.
        arrival_time: When to be at the goal, s on the robot's clock, instead of a duration.
        fastest: As fast as the limits allow, instead of a duration.
        alternative: A further end, TIME:POSITIONS:VELOCITIES:ACCELERATIONS, as 0.8:.2,.5,.8,0,0,0; TIME is a duration
            or an arrival time as @12.5, and what is empty is as in the goal. The end that imitates best is played.
        revises: Correct the motion of this goal_id, which is under way, and imitate what is left of it.
        waypoint: A place on the way, TIME:POSITIONS or TIME:POSITIONS:VELOCITIES, as 0.5:0.1,_,_,_,_,_ (_ is free).
        limit_positions: Tighter limits for this goal, LOW:HIGH or _ a joint, rad; a single one is for all joints.
        limit_velocities: Largest velocity a joint, rad/s, or _; a single one is for all joints.
        limit_accelerations: Largest acceleration a joint, rad/s², or _; a single one is for all joints.
        limit_jerks: Largest jerk a joint, rad/s³, or _; a single one is for all joints.
        start_positions: With --plan-only: plan from here, rad, instead of where the arm will be.
        start_velocities: With --start-positions: the velocity there, rad/s; by default zero.
        start_accelerations: With --start-positions: the acceleration there, rad/s², _ for free; by default free.
        rest_fraction: Final part of the duration without acceleration, 0 to below 1.
        place_time: Keep the demonstrated places but for about this long at both ends, s; by default a start or goal
            that differs moves all of them.
        follow_through: Keep the final velocity this long after the goal, s, at most 0.5.
        tail: Behind the goal: stop inside the limits, or coast on (--plan-only).
        method: The quadratic program, the same as the paper has it, or the movement primitive both are compared with.
        goal_id: Name of the motion; by default the planner makes one.
        client_id: Your name, for a lease.
        lease: Stop the arm when this command ends early, and keep other clients away until the motion has ended.
        plan_only: Plan, and move nothing.
        no_preempt: Be refused instead of taking the place of a motion that runs.
        wait: Follow the motion to its end and print the result.
        save: Write the planned trajectory to this .msgpack file; with --plan-only it is for `execute`.
    """

    primitive: Positional[str]
    positions: Words = ()
    velocities: Words = ()
    accelerations: Words = ()
    duration: float | None = None
    arrival_time: float | None = None
    fastest: bool = False
    alternative: UseAppendAction[Annotated[tuple[str, ...], arg(metavar="TIME:POSITIONS")]] = ()
    revises: str | None = None
    waypoint: UseAppendAction[Annotated[tuple[str, ...], arg(metavar="TIME:POSITIONS")]] = ()
    limit_positions: Words = ()
    limit_velocities: Words = ()
    limit_accelerations: Words = ()
    limit_jerks: Words = ()
    start_positions: Words = ()
    start_velocities: Words = ()
    start_accelerations: Words = ()
    rest_fraction: float = 0.0
    place_time: float | None = None
    follow_through: float = 0.0
    tail: Literal["stop", "coast"] = "stop"
    method: Literal["qp", "gaussian", "dmp"] = "qp"
    goal_id: str | None = None
    client_id: str = ""
    lease: bool = False
    plan_only: bool = False
    no_preempt: bool = False
    wait: bool = False
    save: Path | None = None


def goal(flags: Annotated[GoalFlags, arg(name="")], *, shell: Shared) -> int:
    """Play a primitive to a goal: goal forehand --positions .17 .47 .86 -.08 0 .1 --duration .8 --wait

    Ctrl-C while waiting leaves the motion running, unless it has a lease.
    """
    with reach(shell) as link:
        description = link.description()
        request = to_message(flags, description.joint_names if description else [])
        if request.lease:
            link.bus.announce(f"client/{request.client_id}")
        reply = link.ask(GOAL, request)
        if flags.save and reply.trajectory:
            flags.save.write_bytes(encode(executable(reply, reply.trajectory, description)))
        link.print(reply)
        if flags.plan_only or not (flags.wait or flags.lease):
            return 0
        try:
            result = follow(link, reply.goal_id)
        except KeyboardInterrupt:
            means = "the lease ends, and the controller stops it" if flags.lease else "it goes on; stop it with: cancel"
            print(f"goal {reply.goal_id} is no longer followed: {means}", file=sys.stderr)
            raise
        link.print(result)
        return 0 if result.outcome == "succeeded" else 1


def to_message(flags: GoalFlags, names: Sequence[str]) -> m.Goal:
    """Return the goal that the flags describe; `names` of the joints, empty where they are not known.

    Raises:
        UsageError: a vector that does not fit, or flags that contradict each other.
    """
    _check(flags)
    return m.Goal(
        primitive=flags.primitive,
        positions=_given(joints.vector, flags.positions, "--positions", names),
        velocities=_given(joints.vector, flags.velocities, "--velocities", names),
        accelerations=_given(joints.partial, flags.accelerations, "--accelerations", names),
        duration=flags.duration,
        arrival_time=flags.arrival_time,
        alternatives=[joints.alternative(text, names) for text in flags.alternative],
        fastest=flags.fastest,
        revises=flags.revises,
        goal_id=flags.goal_id,
        client_id=flags.client_id or (f"shell-{uuid.uuid4().hex[:8]}" if flags.lease else ""),
        lease=flags.lease,
        start=_start(flags, names),
        waypoints=[joints.waypoint(text, names) for text in flags.waypoint],
        limits=_limits(flags, names),
        rest_fraction=flags.rest_fraction,
        place_time=flags.place_time,
        follow_through=flags.follow_through,
        tail=flags.tail,
        method=flags.method,
        plan_only=flags.plan_only,
        include_trajectory=flags.save is not None,
        preempt=not flags.no_preempt,
    )


def executable(reply: m.GoalReply, trajectory: m.Trajectory, description: m.Description | None) -> m.Trajectory:
    """Return the trajectory of a reply as `execute` takes it: as pieces where its samples lie further apart."""
    if not trajectory.pieces:
        return trajectory
    tick = 1.0 / description.rate_hz if description else trajectory.dt
    counted = {
        "dt": tick,
        "count": math.ceil(trajectory.pieces.breaks[-1] / tick - ROUNDING) + 1,
        "hit_index": round(reply.duration / tick),
    }
    return replace(trajectory, positions=None, velocities=None, accelerations=None, **counted)


def follow(link: Shell, goal_id: str) -> m.Result:
    """Ask for the result of a goal until it has ended, and return it.

    Raises:
        Refusal, NoAnswer: as `Shell.ask`.
    """
    waiting = link.console.status(f"goal {goal_id} runs") if sys.stdout.isatty() else nullcontext()
    with waiting:
        while True:
            result = link.ask(RESULT, m.ResultRequest(goal_id=goal_id))
            if result.outcome != "running":
                return result
            time.sleep(POLL_S)


def _check(flags: GoalFlags) -> None:
    if flags.duration is not None and flags.arrival_time is not None:
        raise UsageError("--duration and --arrival-time say the same thing twice; give one of them")
    if flags.fastest and (flags.duration, flags.arrival_time) != (None, None):
        raise UsageError("--fastest finds the duration itself; leave out --duration and --arrival-time")
    if flags.start_positions and not flags.plan_only:
        raise UsageError("--start-positions needs --plan-only: a motion starts where the arm is")
    if (flags.start_velocities or flags.start_accelerations) and not flags.start_positions:
        raise UsageError("--start-velocities and --start-accelerations need --start-positions")
    if flags.tail == "coast" and not flags.plan_only:
        raise UsageError("--tail coast needs --plan-only: an arm that moves comes to rest")
    if flags.plan_only and (flags.wait or flags.lease):
        raise UsageError("--plan-only moves nothing; leave out --wait and --lease")


def _given(
    parse: Callable[[Sequence[str], str, Sequence[str]], Parsed], words: Words, flag: str, names: Sequence[str]
) -> Parsed | None:
    return parse(words, flag, names) if words else None


def _start(flags: GoalFlags, names: Sequence[str]) -> m.Start | None:
    if not flags.start_positions:
        return None
    return m.Start(
        positions=joints.vector(flags.start_positions, "--start-positions", names),
        velocities=_given(joints.vector, flags.start_velocities, "--start-velocities", names),
        accelerations=_given(joints.partial, flags.start_accelerations, "--start-accelerations", names),
    )


def _limits(flags: GoalFlags, names: Sequence[str]) -> m.GoalLimits | None:
    limits = m.GoalLimits(
        positions=_given(joints.ranges, flags.limit_positions, "--limit-positions", names),
        velocities=_given(joints.bounds, flags.limit_velocities, "--limit-velocities", names),
        accelerations=_given(joints.bounds, flags.limit_accelerations, "--limit-accelerations", names),
        jerks=_given(joints.bounds, flags.limit_jerks, "--limit-jerks", names),
    )
    return limits if limits != m.GoalLimits() else None
