"""Client library of a robot: five lines play a motion.

    from client import connect

    with connect() as arm:
        result = arm.goal("forehand").wait()
        print(result.outcome)

`connect_async` is its asynchronous twin, whose methods are awaited. Replies and publications are the messages of the
wire contract, in `messages`; `topics` lists the publications.
"""

from client.arms import Arm, AsyncArm
from client.connection import ROBOT, NoRouter, connect, connect_async
from client.fields import GoalFields, tool
from client.handles import AsyncGoalHandle, AsyncMotionHandle, GoalHandle, MotionHandle
from client.streams import AsyncStream, Stream, StreamEnded
from client.trajectories import Samples, executable, samples
from protocol import messages, topics
from protocol.errors import NoAnswer, Refusal

__all__ = [
    "ROBOT",
    "Arm",
    "AsyncArm",
    "AsyncGoalHandle",
    "AsyncMotionHandle",
    "AsyncStream",
    "GoalFields",
    "GoalHandle",
    "MotionHandle",
    "NoAnswer",
    "NoRouter",
    "Refusal",
    "Samples",
    "Stream",
    "StreamEnded",
    "connect",
    "connect_async",
    "executable",
    "messages",
    "samples",
    "tool",
    "topics",
]
