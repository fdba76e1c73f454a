"""The commands that speak to the controller about motions and its state."""

from typing import Annotated

from tyro.conf import arg

from client import MotionHandle, Refusal
from protocol import messages as m
from protocol.codec import check_request_size, decode
from protocol.topics import EXECUTE
from tools.shell.flags import AnyGoal, NamedGoal, Seconds, Source, Switch
from tools.shell.following import follow
from tools.shell.shell import Shared, UsageError, reach


def execute(file: Source, *, lead: Seconds = None, wait: Switch = False, shell: Shared) -> int:
    """Play a trajectory from a .msgpack file, as `goal --plan-only --save` writes it.

    The arm must be where it begins, and unless the clock is stepped --lead must move it into the future.

    Args:
        file: One Trajectory message.
        lead: Start this long from now, s, under the controller's present epoch, instead of as the file says.
        wait: Follow the motion to its end and print the result.
        shell: How to reach the robot.
    """
    try:
        body = file.read_bytes()
        check_request_size(EXECUTE, len(body))
        trajectory = decode(body, m.Trajectory, EXECUTE.max_bytes)
    except OSError as error:
        raise UsageError(f"{file} cannot be read: {error.strerror}") from None
    except Refusal as error:
        raise UsageError(f"{file} holds no trajectory: {error}") from None
    with reach(shell) as link:
        motion: MotionHandle = link.arm.execute(trajectory, lead)
        link.print(m.Accepted(goal_id=motion.goal_id, start_time=motion.start_time))
        return follow(link, motion) if wait else 0


def reference(*, lead: Annotated[float, arg(metavar="S")] = 0.0, shell: Shared) -> None:
    """Print where everything accepted so far will have the arm.

    Args:
        lead: That long from now, s.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        link.print(link.arm.reference(lead))


def cancel(goal_id: AnyGoal = None, *, shell: Shared) -> None:
    """Stop the motion inside the limits.

    Args:
        goal_id: Stop only this one; by default whatever moves.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        link.print(link.arm.cancel(goal_id))


def reset(*, shell: Shared) -> None:
    """Leave a latched fault; the arm must be at rest."""
    with reach(shell) as link:
        link.print(link.arm.reset())


def result(goal_id: NamedGoal, *, shell: Shared) -> None:
    """Print how a goal went.

    Args:
        goal_id: As the goal's reply named it.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        link.print(link.arm.result(goal_id))


def status(*, shell: Shared) -> None:
    """Print the controller at a glance: mode, goal, reference and errors, how well it keeps time."""
    with reach(shell) as link:
        link.print(link.arm.status())
