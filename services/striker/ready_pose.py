"""The return to the ready pose."""

import logging
import math
from collections.abc import Callable, Iterator

from protocol import messages as m
from robot.description import RobotConfig
from services.striker.link import AcceptedGoal, Reply
from services.striker.messages import READY_S, ready_goal
from services.striker.primitives import StrikePrimitives

RETRY_S = 1.0
"""Time between attempts to return to the ready pose, s."""


class ReadyPoseReturn:
    """Sends the arm to the ready pose, where it waits for the next ball.

    away: whether the arm may be elsewhere; set it when a swing is requested.
    """

    def __init__(
        self,
        config: RobotConfig,
        primitives: StrikePrimitives,
        send_goal: Callable[[m.Goal], object],
        log: logging.Logger,
    ) -> None:
        self.away = False
        self._config = config
        self._primitives = primitives
        self._send_goal = send_goal
        self._log = log
        self._goal_id: str | None = None
        self._next_try = -math.inf

    def request(self, now: float, goal_ids: Iterator[str], allowed: tuple[str, ...]) -> None:
        """Request the return, unless the arm is in the ready pose or returning.

        now: s. goal_ids: the goal takes the next one. allowed: primitives to imitate if the library has no `ready`.
        """
        if not self.away or self._goal_id or now < self._next_try:
            return
        self._goal_id, self._next_try = next(goal_ids), now + RETRY_S
        primitive = self._primitives.ready or self._primitives.nearest(READY_S, allowed)
        self._send_goal(ready_goal(self._goal_id, self._config, primitive))

    def handle_reply(self, goal_id: str, reply: Reply) -> bool:
        """Process the reply to a goal; return whether the goal was a return."""
        if goal_id != self._goal_id:
            return False
        self._goal_id = None
        if isinstance(reply, AcceptedGoal):
            self.away, self._next_try = False, -math.inf
        else:
            self._log.warning("cannot go to the ready pose: %s; tries again in %.0f s", reply, RETRY_S)
        return True

    def begin_run(self) -> None:
        """Forget pending requests; after a new run the arm may be anywhere."""
        self.away, self._goal_id, self._next_try = True, None, -math.inf
