"""Motions that were taken: waiting for their end, stopping and correcting them."""

from collections.abc import Callable, Coroutine
from typing import Any, Self, Unpack

from client.fields import GoalFields
from client.link import Link
from client.results import Results
from client.twofold import Awaits, Blocks, Twofold
from protocol import messages as m
from protocol.topics import CANCEL, RESULT


class Following:
    """What a handle of any motion can do. Every method raises NoAnswer where the controller is silent.

    Attributes:
        goal_id: Names the motion in everything that is published of it.
        start_time: When it starts, s on the robot's clock.
    """

    def __init__(self, link: Link, results: Results, goal_id: str, start_time: float) -> None:
        self.goal_id = goal_id
        self.start_time = start_time
        self._link = link
        self._results = results

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.goal_id}>"

    @Twofold
    async def wait(self, timeout: float | None = None) -> m.Result:
        """Wait until the motion has ended and return how it went, whatever its outcome.

        Args:
            timeout: Longest wait, s; None waits without end. The robot's clock may be slower than the wall's.

        Raises:
            TimeoutError: it has not ended by then.
            Refusal: `unknown_goal`, where the controller was restarted meanwhile.
        """
        return await self._results.wait(self.goal_id, timeout)

    @Twofold
    async def result(self) -> m.Result:
        """Return how the motion goes, `running` while it has not ended.

        Raises:
            Refusal: `unknown_goal`, where the controller was restarted meanwhile.
        """
        return await self._link.ask(RESULT, m.ResultRequest(goal_id=self.goal_id))

    @Twofold
    async def cancel(self) -> m.Canceled:
        """Stop this motion inside the limits; another one that took its place moves on."""
        return await self._link.ask(CANCEL, m.Cancel(goal_id=self.goal_id))


class Correcting(Following):
    """What a handle of a goal can do besides.

    Attributes:
        primitive: What the goal imitates.
        reply: The planner's, with its report.
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

    @Twofold
    async def correct(self, **fields: Unpack[GoalFields]) -> Self:
        """Correct this motion while it is under way: imitate what is left of the demonstration, to another end.

        Without `duration` and `arrival_time` the hit keeps its time. The new handle stands for the corrected motion;
        this one ends as `preempted`.

        Args:
            fields: As of `goal`; only what is given here counts, not what the corrected goal had said.

        Raises:
            Refusal: `late` where the hit has passed, `superseded` where another motion replaced it, `unknown_goal`
                where it is not under way, and whatever refuses a goal. The motion then goes on as it was.
        """
        return await self._send(self.primitive, {**fields, "revises": self.goal_id})


class MotionHandle(Following, Blocks):
    """An executed trajectory: its methods block."""


class AsyncMotionHandle(Following, Awaits):
    """An executed trajectory: its methods are awaited."""


class GoalHandle(Correcting, Blocks):
    """A goal that is played: its methods block."""


class AsyncGoalHandle(Correcting, Awaits):
    """A goal that is played: its methods are awaited."""
