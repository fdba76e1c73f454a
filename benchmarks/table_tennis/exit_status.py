"""The exit status of both commands."""

import sys
from collections.abc import Callable

from benchmarks.table_tennis.scene import NotInstalled
from motion.errors import MotionError
from protocol.errors import NoAnswer, Refusal
from services.common.cli import MISUSED
from services.common.supervisor import NotReady

INTERRUPTED = 130


def exit_status_of(play: Callable[[], object]) -> int:
    """Call `play`, print an error as a sentence, and return the exit status."""
    try:
        play()
    except (NotInstalled, NotReady, Refusal, NoAnswer, MotionError, ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return MISUSED
    except KeyboardInterrupt:
        return INTERRUPTED
    return 0
