"""Commands for the ball: throw it, and return it."""

from typing import Annotated

from tyro.conf import Positional, arg

from tools.shell.flags import Place, Seconds, Switch
from tools.shell.shell import Shared, UsageError, reach

Words = Annotated[tuple[str, ...], arg(metavar="NAME ...", help_behavior_hint="")]


def ball(
    *,
    position: Place = (5.0, -0.5, 1.2),
    velocity: Place = (-5.6, -0.3, 2.2),
    spin: Place = (0.0, 0.0, 0.0),
    shell: Shared,
) -> None:
    """Throw the ball, in the present run; without flags, within reach of the shipped arm.

    Args:
        position: Initial position, m.
        velocity: Initial velocity, m/s.
        spin: Initial angular velocity, rad/s.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        link.print(link.arm.throw(position, velocity, spin))


def strike(
    target: Positional[Annotated[tuple[float, ...], arg(metavar="X Y Z")]] = (),
    *,
    stop: Switch = False,
    flight_time: Seconds = None,
    count: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
    primitives: Words = (),
    revise_hz: Annotated[float, arg(metavar="HZ")] = 50.0,
    until: Annotated[float, arg(metavar="S")] = 0.05,
    shell: Shared,
) -> None:
    """Return every ball that comes within reach to a target, until --count balls or `volley strike --stop`.

    Args:
        target: Where the balls must land, m.
        stop: Stop returning balls.
        flight_time: Time from the touch to the landing, s; by default the striker chooses it.
        count: Number of balls to return; by default unlimited.
        primitives: Primitives that may be imitated; by default all of the library.
        revise_hz: Rate of corrections during the swing, Hz; 0: none.
        until: No corrections later than this time before the touch, s.
        shell: How to reach the robot.
    """
    if stop == bool(target):
        raise UsageError("strike needs a target, X Y Z, or --stop")
    if target and len(target) != 3:
        raise UsageError(f"strike: the target has {len(target)} numbers; it needs X Y Z")
    with reach(shell) as link:
        if stop:
            link.print(link.arm.stop_striking())
            return
        striking = link.arm.strike(
            target,
            flight_time=flight_time,
            count=count,
            primitives=primitives or None,
            revise_hz=revise_hz,
            until_s=until,
        )
        link.print(striking)
