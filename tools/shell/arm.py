"""Commands to the robot side: the arm, and the simulation."""

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
    "noise": ("sensor_noise", set(), {"--position-std", "--velocity-std"}),
    "ball-noise": ("ball_noise", set(), {"--position-std", "--latency", "--drop-rate"}),
    "wind": ("wind", {"--values"}, set()),
    "loss": ("loss", {"--stream", "--duration"}, set()),
}
"""Kind of disturbance: its name in the contract, the flags that it requires, and those that it allows."""


def state(*, shell: Shared) -> None:
    """Print the arm's measured state."""
    with reach(shell) as link:
        link.print(link.arm.state())


def description(*, shell: Shared) -> None:
    """Print the arm's joints, home, limits and clock."""
    with reach(shell) as link:
        link.print(link.arm.description())


def recover(*, shell: Shared) -> None:
    """Make the arm ready again after a reflex, a stop or braking; a new run begins at its present pose."""
    with reach(shell) as link:
        link.print(link.arm.recover())


def hold(pairs: Positional[Annotated[tuple[str, ...], arg(metavar="JOINT VALUE ...")]], *, shell: Shared) -> None:
    """Move held joints, for example of a gripper: `volley hold finger_joint1 0.02 finger_joint2 0.02`.

    Args:
        pairs: JOINT VALUE for each joint to move, rad or m.
        shell: How to reach the robot.
    """
    targets = joints.by_name(pairs)
    with reach(shell) as link:
        link.print(link.arm.hold(targets))


def step(ticks: Positional[Annotated[int, arg(metavar="TICKS")]] = 1, *, shell: Shared) -> None:
    """Advance the stepped clock.

    Args:
        ticks: Number of ticks, 1 to 10000.
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
    """Start a new run: the arm at rest, the ball on its tee, the clock at 0.

    Args:
        positions: Initial joint positions, rad; by default home.
        ball: Initial position of the ball, m; by default on its tee.
        ball_velocity: With --ball: initial velocity of the ball, m/s.
        seed: Seed of the sensor noise; with the stepped clock also the number of the run.
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
    """Disturb the arm: push it, add noise to its sensors or to the measured ball, add wind, or drop messages.

    Args:
        kind: A push by acceleration or torque (--values, --duration, --at), sensor noise (--position-std,
            --velocity-std), worse measurements of the ball (--position-std, --latency, --drop-rate), wind (--values),
            or loss of messages (--stream, --duration).
        values: Push on each joint, rad/s² or N·m; or wind along x, y and z, m/s.
        at: Start of the push, s on the robot's clock; by default now.
        duration: Duration of the push or the loss, s.
        position_std: Standard deviation of measured joint positions, rad, or of the ball's, m, until set again; 0
            without it.
        velocity_std: Standard deviation of measured joint velocities, rad/s, until set again; 0 without it.
        stream: Stream whose messages are dropped.
        latency: Delay of the ball's measurements, s, until set again; 0 without it.
        drop_rate: Fraction of the ball's measurements that are dropped, 0 to 1, until set again; 0 without it.
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
    """Check that a disturbance has exactly the flags of its kind.

    Raises:
        UsageError: a flag is missing, or belongs to another kind.
    """
    _, needed, optional = KINDS[kind]
    if missing := sorted(needed - given):
        raise UsageError(f"disturb {kind} needs {' and '.join(missing)}")
    if alien := sorted(given - needed - optional):
        raise UsageError(f"disturb {kind} does not take {' and '.join(alien)}")
