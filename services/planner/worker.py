"""`python -m services.planner.worker FD`: learns what comes over a socket, in a process of the planner's own.

The planner sends the arm's limits and joint names, then the body of one `learn` request after another; each is
answered by what was learned or by why not. The process ends with the planner, however that ends.
"""

import contextlib
import ctypes
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

from motion.inspection import warnings_of
from motion.limits import Limits
from motion.primitive import Primitive
from protocol import messages as m
from protocol.codec import decode
from protocol.errors import Refusal
from protocol.topics import LEARN
from services.planner.learning import demonstration_of, learn_demonstration

NICENESS = 10
"""Added to the planner's own: plans come first."""

OWN_ERROR = "the planner met an error of its own; please report what its log says"

PR_SET_PDEATHSIG = 1


@dataclass(frozen=True, slots=True, eq=False)
class Lesson:
    """A primitive, and `warnings` about its recording."""

    primitive: Primitive
    warnings: list[str]


@dataclass(frozen=True, slots=True)
class Failure:
    """A refusal as plain values; `report` is the traceback of an error that nobody foresaw."""

    code: str
    message: str
    detail: dict[str, Any] = field(default_factory=dict)
    report: str = ""


def main() -> None:
    """Answer requests until the planner closes its end."""
    end_with_parent()
    with contextlib.suppress(OSError):
        os.nice(NICENESS)
    with Connection(int(sys.argv[1])) as connection, contextlib.suppress(EOFError, ConnectionError):
        limits, names = connection.recv()
        while True:
            connection.send(learned(connection.recv_bytes(), limits, names))


def learned(body: bytes, limits: Limits, names: Sequence[str]) -> Lesson | Failure:
    """Learn from the body of a request."""
    try:
        request = decode(body, m.Learn, LEARN.max_bytes)
        demonstration = demonstration_of(request)
        primitive = learn_demonstration(demonstration, request.smoothing)
        return Lesson(primitive, warnings_of(demonstration, primitive, limits, names))
    except Refusal as refusal:
        return Failure(refusal.code, refusal.message, refusal.detail)
    except Exception:
        return Failure("unavailable", OWN_ERROR, {"service": "planner"}, traceback.format_exc())


def end_with_parent() -> None:
    """Have the kernel end this process when the thread that started it is gone, in the middle of a fit too."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


if __name__ == "__main__":
    # Under its importable name, so that the planner can unpickle what comes back.
    from services.planner import worker

    worker.main()
