"""Handles of accepted motions: wait for their end, stop and correct them."""

from collections.abc import Callable, Coroutine
from typing import Any, Self, Unpack

from client.fields import GoalFields
from client.link import Link
from client.results import Results
from client.sync_or_async import Async, Sync, SyncOrAsync
from protocol import messages as m
from protocol.topics import CANCEL, RESULT


class MotionBase:
    """Handle of an accepted motion. Every method raises NoAnswer if the controller does not reply.

    Attributes:
        goal_id: Name of the motion in all publications.
        start_time: Start of the motion, s on the robot's clock.
    """

    def __init__(self, link: Link, results: Results, goal_id: str, start_time: float) -> None:
        self.goal_id = goal_id
        self.start_time = start_time
        self._link = link
        self._results = results

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.goal_id}>"

    @SyncOrAsync
    async def wait(self, timeout: float | None = None) -> m.Result:
        """Wait until the motion has ended and return its result, whatever the outcome.

        Args:
            timeout: Timeout, s of wall time; None: no timeout. The robot's clock may be slower than the wall clock.

        Raises:
            TimeoutError: the motion has not ended within the timeout.
            Refusal: `unknown_goal`, if the controller was restarted meanwhile.
        """
        return await self._results.wait(self.goal_id, timeout)

    @SyncOrAsync
    async def result(self) -> m.Result:
        """Return the motion's result so far, with the outcome `running` until it ends.

        Raises:
            Refusal: `unknown_goal`, if the controller was restarted meanwhile.
        """
        return await self._link.ask(RESULT, m.ResultRequest(goal_id=self.goal_id))

    @SyncOrAsync
    async def cancel(self) -> m.Canceled:
        """Stop this motion inside the limits; a motion that has replaced it continues."""
        return await self._link.ask(CANCEL, m.Cancel(goal_id=self.goal_id))


class GoalBase(MotionBase):
    """Handle of a goal's motion, which can also be corrected.

    Attributes:
        primitive: Name of the imitated primitive.
        reply: The planner's reply, with its report.
    """

    def __init__(
        self,
        link: Link,
        results: Results,
        send: Callable[[str, GoalFields], Coroutine[Any, Any, Self]],
        primitive: str,
        reply: m.GoalReply,
    ) -> None:
        super().__init__(link, results, reply.goal_id, reply.start_time)
        self.primitive = primitive
        self.reply = reply
        self._send = send

    @SyncOrAsync
    async def correct(self, **fields: Unpack[GoalFields]) -> Self:
        """Correct this motion while it runs: imitate the rest of the demonstration, to another end.

        Without `duration` and `arrival_time` the time of the hit does not change. The returned handle is that of the
        corrected motion; this motion ends with the outcome `preempted`.

        Args:
            fields: As for `goal`. Fields of the corrected goal are not inherited.

        Raises:
            Refusal: `late` if the hit has passed, `superseded` if another motion has replaced this one,
                `unknown_goal` if it does not run, or any refusal of a goal. This motion then continues unchanged.
        """
        return await self._send(self.primitive, {**fields, "revises": self.goal_id})


class MotionHandle(MotionBase, Sync):
    """Handle of an executed trajectory; its methods block."""


class AsyncMotionHandle(MotionBase, Async):
    """Handle of an executed trajectory; its methods are awaited."""


class GoalHandle(GoalBase, Sync):
    """Handle of a goal's motion; its methods block."""


class AsyncGoalHandle(GoalBase, Async):
    """Handle of a goal's motion; its methods are awaited."""
