"""The two kinds of arm: one whose methods block, and one whose methods are awaited."""

from typing import Self

from client.handles import AsyncGoalHandle, AsyncMotionHandle, GoalHandle, MotionHandle
from client.link import Link
from client.requests import Requests
from client.streams import LENGTH, AsyncStream, Stream
from client.twofold import Awaits, Blocks
from protocol.topics import MessageT, Publication


class Arm(Requests[GoalHandle, MotionHandle], Blocks):
    """A robot on the bus, made by `connect`. Its methods block, and may be called from several threads.

    Every method raises `Refusal` where the request is refused, with a `code`, a sentence and a `detail`, and `NoAnswer`
    where nobody answers. A refused request changes nothing.
    """

    def __init__(self, link: Link) -> None:
        super().__init__(link, GoalHandle, MotionHandle)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the bus; a lease is lost, and streams end. The `with` block does it."""
        self._link.close()

    def stream(self, topic: Publication[MessageT], length: int = LENGTH) -> Stream[MessageT]:
        """Listen to what is published on a topic from now on, as `for state in arm.stream(topics.STATE)`.

        Args:
            topic: One of `topics`: STATE, COMMAND, STATUS, PLAN, REFUSED, ENDED, CONTACT, BALL, SCENE,
                DISTURBANCE, STRIKES.
            length: Messages kept until they are taken; of more the oldest are dropped.
        """
        return Stream(self._link, topic, length)


class AsyncArm(Requests[AsyncGoalHandle, AsyncMotionHandle], Awaits):
    """A robot on the bus, made by `connect_async`. Its methods are those of `Arm`, and are awaited."""

    def __init__(self, link: Link) -> None:
        super().__init__(link, AsyncGoalHandle, AsyncMotionHandle)

    def stream(self, topic: Publication[MessageT], length: int = LENGTH) -> AsyncStream[MessageT]:
        """Listen to what is published on a topic from now on, as `async for state in arm.stream(topics.STATE)`.

        Args:
            topic: One of `topics`.
            length: Messages kept until they are taken; of more the oldest are dropped.
        """
        return AsyncStream(self._link, topic, length)
