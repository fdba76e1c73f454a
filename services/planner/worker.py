"""`python -m services.planner.worker FD ROLE`: a process for the planner's long computations.

The planner sends the arm's limits and joint names over a socket, then one request after another: bodies of `learn`
requests to the role "learn", pickled Tasks to the role "plan". The reply to each is its result or a Failure. The
process ends with the planner, even if the planner is killed.
"""

import contextlib
import ctypes
import pickle
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

from motion.errors import MotionError
from motion.gaussian import SAFETY_MARGIN, plan_gaussian
from motion.limits import Limits
from motion.primitive import Primitive
from motion.request import MotionRequest
from motion.sampled import SampledPlan
from protocol import messages as m
from protocol.codec import decode
from protocol.errors import Refusal
from protocol.topics import LEARN
from robot.recordings.inspection import warnings_of
from services.common.realtime import become_nice
from services.common.refusing import OWN_ERROR
from services.planner.learning import demonstration_of, learn_demonstration, spread_of
from services.planner.refusals import Joints, refusal_of

LEARNING_NICE = 5
"""Niceness of each role: plans have priority; beside a busy program, learning still gets a quarter of a core."""

PR_SET_PDEATHSIG = 1


@dataclass(frozen=True, slots=True, eq=False)
class LearnedPrimitive:
    """A primitive, and `warnings` about its recording."""

    primitive: Primitive
    warnings: list[str]


@dataclass(frozen=True, slots=True)
class Failure:
    """A refusal as plain values; `report` is the traceback of an unexpected error."""

    code: str
    message: str
    detail: dict[str, Any] = field(default_factory=dict)
    report: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """A motion to plan with the method "gaussian"."""

    primitive: Primitive
    request: MotionRequest
    tick: float
    joints: Joints


def main() -> None:
    """Answer requests until the planner closes its end."""
    end_with_parent()
    role = ROLES[sys.argv[2]]
    become_nice(0 if role is planned else LEARNING_NICE)
    with Connection(int(sys.argv[1])) as connection, contextlib.suppress(EOFError, ConnectionError):
        limits, names = connection.recv()
        while True:
            connection.send(outcome(role, connection.recv_bytes(), limits, names))


def outcome(
    role: "Role", body: bytes, limits: Limits, names: Sequence[str]
) -> "LearnedPrimitive | SampledPlan | Failure":
    """Return a role's result of a request, or the failure."""
    try:
        return role(body, limits, names)
    except Refusal as refusal:
        return Failure(refusal.code, refusal.message, refusal.detail)
    except Exception:
        return Failure(
            "unavailable", OWN_ERROR.format(service="planner"), {"service": "planner"}, traceback.format_exc()
        )


def learned(body: bytes, limits: Limits, names: Sequence[str]) -> LearnedPrimitive:
    """Learn from the body of a `learn` request. Raises Refusal."""
    request = decode(body, m.Learn, LEARN.max_bytes)
    demonstration = demonstration_of(request, names)
    primitive = learn_demonstration(demonstration, request.smoothing, spread_of(request, names))
    return LearnedPrimitive(primitive, warnings_of(demonstration, primitive, limits, names))


def planned(body: bytes, _: Limits, __: Sequence[str]) -> SampledPlan:
    """Plan a pickled Task from the planner. Raises Refusal."""
    task: Task = pickle.loads(body)
    try:
        return plan_gaussian(task.primitive, task.request, task.tick, margin=SAFETY_MARGIN)
    except MotionError as error:
        raise refusal_of(error, task.joints) from None


Role = Callable[[bytes, Limits, Sequence[str]], LearnedPrimitive | SampledPlan]
ROLES: dict[str, Role] = {"learn": learned, "plan": planned}


def end_with_parent() -> None:
    """Make the kernel end this process when the thread that started it ends, even during a fit."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


if __name__ == "__main__":
    # Imported by its module name, so that the planner can unpickle the results.
    from services.planner import worker

    worker.main()
