"""The commands that speak to the robot side: the arm, and what only a simulated one has."""

from collections.abc import Mapping
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from protocol import messages as m
from tools.shell import joints
from tools.shell.flags import MaybePlace, Number, Place, Seconds, Words
from tools.shell.shell import Shared, UsageError, reach

DisturbanceKind = Literal["acceleration", "torque", "sensor_noise", "ball_noise", "wind", "loss"]
Kind = Literal["acceleration", "torque", "noise", "ball-noise", "wind", "loss"]
KINDS: Mapping[Kind, tuple[DisturbanceKind, set[str], set[str]]] = {
    "acceleration": ("acceleration", {"--values", "--duration"}, {"--at"}),
    "torque": ("torque", {"--values", "--duration"}, {"--at"}),
    "noise": ("sensor_noise", {"--position-std", "--velocity-std"}, set()),
    "ball-noise": ("ball_noise", {"--position-std"}, {"--latency", "--drop-rate"}),
    "wind": ("wind", {"--values"}, set()),
    "loss": ("loss", {"--stream", "--duration"}, set()),
}
"""The contract's word for each, the flags that it needs, and those that it may have besides."""


def state(*, shell: Shared) -> None:
    """Print what the arm measures."""
    with reach(shell) as link:
        link.print(link.arm.state())


def description(*, shell: Shared) -> None:
    """Print what the arm is: joints, home, limits, clock."""
    with reach(shell) as link:
        link.print(link.arm.description())


def recover(*, shell: Shared) -> None:
    """Make the arm ready again after a reflex, a stop or its own brake: a new run begins where it stands."""
    with reach(shell) as link:
        link.print(link.arm.recover())


def hold(pairs: Positional[Annotated[tuple[str, ...], arg(metavar="JOINT VALUE ...")]], *, shell: Shared) -> None:
    """Lead held joints, as those of a gripper, to new values: `volley hold finger_joint1 0.02 finger_joint2 0.02`.

    Args:
        pairs: JOINT VALUE, rad or m, for each joint that is to move.
        shell: How to reach the robot.
    """
    targets = joints.by_name(pairs)
    with reach(shell) as link:
        link.print(link.arm.hold(targets))


def step(ticks: Positional[Annotated[int, arg(metavar="TICKS")]] = 1, *, shell: Shared) -> None:
    """Advance the stepped clock.

    Args:
        ticks: 1 to 10000.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        link.print(link.arm.step(ticks))


def reset_sim(
    *,
    positions: Words = (),
    ball: MaybePlace = None,
    ball_velocity: Place = (0.0, 0.0, 0.0),
    seed: Annotated[int, arg(metavar="N")] = 0,
    shell: Shared,
) -> None:
    """Begin a new run: the arm at rest, the ball on its tee, the clock at 0.

    Args:
        positions: Where the arm begins, rad a joint; by default home.
        ball: Where the ball begins, m; by default on its tee.
        ball_velocity: With --ball: its velocity, m/s.
        seed: Of the sensor noise; names the run where the clock is stepped.
        shell: How to reach the robot.
    """
    if ball is None and any(ball_velocity):
        raise UsageError("--ball-velocity needs --ball: a ball on its tee is at rest")
    start = joints.vector(positions, "--positions") if positions else None
    with reach(shell) as link:
        link.print(link.arm.reset_sim(start, m.Ball(position=ball, velocity=ball_velocity) if ball else None, seed))


def disturb(
    kind: Positional[Kind],
    *,
    values: Words = (),
    at: Seconds = None,
    duration: Seconds = None,
    position_std: Number = None,
    velocity_std: Number = None,
    stream: Annotated[Literal["state", "command"] | None, arg(help_behavior_hint="")] = None,
    latency: Seconds = None,
    drop_rate: Number = None,
    shell: Shared,
) -> None:
    """Disturb the arm: push it, blur its sensors or the sight of the ball, let wind blow, or lose messages.

    Args:
        kind: A push by acceleration or torque (--values, --duration, --at), sensor noise (--position-std,
            --velocity-std), a worse sight of the ball (--position-std, --latency, --drop-rate), wind (--values), or
            loss of messages (--stream, --duration).
        values: Of the push on each joint, rad/s² or N·m; of the wind along x, y and z, m/s.
        at: When the push begins, s on the robot's clock; by default now.
        duration: Of the push or the loss, s.
        position_std: Standard deviation of measured positions, rad, or of the ball's, m, until it is set again.
        velocity_std: Standard deviation of measured velocities, rad/s, until it is set again.
        stream: Whose messages are lost.
        latency: From a sight of the ball to its message, s, until it is set again.
        drop_rate: Part of the sights of the ball that are lost, 0 to 1, until it is set again.
        shell: How to reach the robot.
    """
    given = {"--values": values or None, "--at": at, "--duration": duration, "--stream": stream}
    given |= {"--position-std": position_std, "--velocity-std": velocity_std}
    given |= {"--latency": latency, "--drop-rate": drop_rate}
    check_flags(kind, {flag for flag, value in given.items() if value is not None})
    push = joints.vector(values, "--values") if values else None
    with reach(shell) as link:
        disturbed = link.arm.disturb(
            KINDS[kind][0],
            values=push,
            start_time=at,
            duration=duration,
            position_std=position_std,
            velocity_std=velocity_std,
            stream=stream,
            latency_s=latency,
            drop_rate=drop_rate,
        )
        link.print(disturbed)


def check_flags(kind: Kind, given: set[str]) -> None:
    """Check that a disturbance has the flags of its kind and no others.

    Raises:
        UsageError: one is missing, or belongs to another kind.
    """
    _, needed, optional = KINDS[kind]
    if missing := sorted(needed - given):
        raise UsageError(f"disturb {kind} needs {' and '.join(missing)}")
    if alien := sorted(given - needed - optional):
        raise UsageError(f"disturb {kind} does not take {' and '.join(alien)}")
