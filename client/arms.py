"""A robot on the bus, with methods that block (`Arm`) or are awaited (`AsyncArm`)."""

from typing import Self

from client.handles import AsyncGoalHandle, AsyncMotionHandle, GoalHandle, MotionHandle
from client.link import Link
from client.requests import Requests
from client.streams import LENGTH, AsyncStream, Stream
from client.sync_or_async import Async, Sync
from protocol.topics import MessageT, Publication


class Arm(Requests[GoalHandle, MotionHandle], Sync):
    """A robot on the bus, returned by `connect`. Its methods block, and may be called from several threads.

    Every method raises `Refusal`, with a `code`, a sentence and a `detail`, if the service refuses the request, and
    `NoAnswer` if there is no reply. A refused request changes nothing.
    """

    def __init__(self, link: Link) -> None:
        super().__init__(link, GoalHandle, MotionHandle)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the bus; a lease and all streams end. The end of the `with` block calls this."""
        self._link.close()

    def stream(self, topic: Publication[MessageT], length: int = LENGTH) -> Stream[MessageT]:
        """Subscribe to a topic, for example `for state in arm.stream(topics.STATE)`.

        Args:
            topic: One of `topics`: STATE, COMMAND, STATUS, PLAN, REFUSED, ENDED, CONTACT, BALL, SCENE,
                DISTURBANCE, STRIKES.
            length: Capacity of the stream, messages; a full stream drops its oldest message.
        """
        return Stream(self._link, topic, length)


class AsyncArm(Requests[AsyncGoalHandle, AsyncMotionHandle], Async):
    """A robot on the bus, made by `connect_async`. Its methods are those of `Arm`, and are awaited."""

    def __init__(self, link: Link) -> None:
        super().__init__(link, AsyncGoalHandle, AsyncMotionHandle)

    def stream(self, topic: Publication[MessageT], length: int = LENGTH) -> AsyncStream[MessageT]:
        """Subscribe to a topic, for example `async for state in arm.stream(topics.STATE)`.

        Args:
            topic: One of `topics`.
            length: Capacity of the stream, messages; a full stream drops its oldest message.
        """
        return AsyncStream(self._link, topic, length)
