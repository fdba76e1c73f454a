"""Follow a motion to its end."""

import sys
from contextlib import nullcontext

from client import GoalHandle, MotionHandle
from tools.shell.shell import Shell


def follow(link: Shell, motion: GoalHandle | MotionHandle) -> int:
    """Wait until a motion has ended, print its result and return the exit status, 0 if it succeeded.

    Raises:
        Refusal, NoAnswer: as `wait`.
    """
    waiting = link.console.status(f"goal {motion.goal_id} runs") if sys.stdout.isatty() else nullcontext()
    try:
        with waiting:
            result = motion.wait()
    except KeyboardInterrupt:
        leased = "its lease ends, and the controller stops it"
        means = leased if link.arm.holds_lease else f"it continues; stop it with: volley cancel {motion.goal_id}"
        print(f"goal {motion.goal_id} is no longer followed: {means}", file=sys.stderr)
        raise
    link.print(result)
    return 0 if result.outcome == "succeeded" else 1
