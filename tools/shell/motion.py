"""Commands to the controller: motions and its state."""

import sys
from typing import Annotated

from tyro.conf import arg

from client import MotionHandle, Refusal
from protocol import messages as m
from protocol.codec import check_request_size, decode
from protocol.topics import EXECUTE
from tools.shell.flags import AnyGoal, NamedGoal, Seconds, Source, Switch
from tools.shell.shell import Shared, UsageError, reach


def execute(file: Source, *, lead: Seconds = None, wait: Switch = False, shell: Shared) -> int:
    """Play a trajectory from a .msgpack file, in the format of `goal --plan-only --save`.

    The arm must be at the trajectory's start. Unless the clock is stepped, --lead must set a start time in the future.

    Args:
        file: File with one Trajectory message.
        lead: Start this long from now, s, in the controller's present epoch, instead of at the file's time and epoch.
        wait: Follow the motion to its end and print the result; with --json it is a second line.
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
        return link.follow(motion) if wait else 0


def reference(*, lead: Annotated[float, arg(metavar="S")] = 0.0, shell: Shared) -> None:
    """Print the state of the reference trajectory, of all motions accepted so far.

    Args:
        lead: Time ahead of now, s.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        link.print(link.arm.reference(lead))


def cancel(goal_id: AnyGoal = None, *, shell: Shared) -> None:
    """Stop the motion inside the limits.

    Args:
        goal_id: Stop only this motion; by default any.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        canceled = link.arm.cancel(goal_id)
        link.print(canceled)
        if goal_id is not None and canceled.goal_id is None:
            print(f"goal {goal_id} has ended or was replaced; without an id, cancel stops any motion", file=sys.stderr)


def reset(*, shell: Shared) -> None:
    """Leave a latched fault; the arm must be at rest."""
    with reach(shell) as link:
        link.print(link.arm.reset())


def result(goal_id: NamedGoal, *, shell: Shared) -> int:
    """Print the result of a goal.

    Exit status: 0 if the goal succeeded, as `goal --wait`; 1 for any other outcome, also while the goal runs.

    Args:
        goal_id: Name of the motion, as in the goal's reply.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        return link.print_result(link.arm.result(goal_id))


def status(*, shell: Shared) -> None:
    """Print the controller's mode, goal, reference, errors and timing."""
    with reach(shell) as link:
        link.print(link.arm.status())
