"""The commands that speak to the controller about motions and its state."""

from pathlib import Path

from tyro.conf import Positional

from protocol import messages as m
from protocol.codec import check_request_size, decode
from protocol.errors import Refusal
from protocol.topics import CANCEL, EXECUTE, REFERENCE, RESET, RESULT, STATUS_QUERY
from tools.shell.goal import follow
from tools.shell.shell import Shared, UsageError, reach


def execute(file: Positional[Path], *, lead: float | None = None, wait: bool = False, shell: Shared) -> int:
    """Play a trajectory from a .msgpack file, as `goal --plan-only --save` writes it.

    The arm has to be where it begins, and in real time --lead has to move it into the future.

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
    except (OSError, Refusal) as error:
        raise UsageError(f"{file} holds no trajectory: {error}") from None
    with reach(shell) as link:
        if lead is not None:
            now = link.ask(REFERENCE, m.ReferenceRequest(lead=lead))
            trajectory.start_time, trajectory.epoch = now.time, now.epoch
        reply = link.ask(EXECUTE, trajectory)
        link.print(reply)
        if not wait:
            return 0
        ended = follow(link, reply.goal_id)
        link.print(ended)
        return 0 if ended.outcome == "succeeded" else 1


def reference(*, lead: float = 0.0, shell: Shared) -> None:
    """Print where everything accepted so far will have the arm.

    Args:
        lead: That long from now, s.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        link.exchange(REFERENCE, m.ReferenceRequest(lead=lead))


def cancel(goal_id: Positional[str | None] = None, *, shell: Shared) -> None:
    """Stop the motion.

    Args:
        goal_id: Stop only this one; by default whatever moves.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        link.exchange(CANCEL, m.Cancel(goal_id=goal_id))


def reset(*, shell: Shared) -> None:
    """Leave a latched fault; the arm must be at rest."""
    with reach(shell) as link:
        link.exchange(RESET, m.Empty())


def result(goal_id: Positional[str], *, shell: Shared) -> None:
    """Print how a goal went.

    Args:
        goal_id: As the goal's reply named it.
        shell: How to reach the robot.
    """
    with reach(shell) as link:
        link.exchange(RESULT, m.ResultRequest(goal_id=goal_id))


def status(*, shell: Shared) -> None:
    """Print the controller at a glance."""
    with reach(shell) as link:
        link.exchange(STATUS_QUERY, m.Empty())
