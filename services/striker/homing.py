"""The return to the ready pose."""

import logging
import math
from collections.abc import Callable, Iterator

from protocol import messages as m
from robot.description import RobotConfig
from services.striker.messages import READY_S, ready_goal
from services.striker.outside import Reply, Taken
from services.striker.repertoire import Repertoire

RETRY_S = 1.0
"""Time between attempts to return to the ready pose, s."""


class Homing:
    """Sends the arm to the ready pose, where it waits for the next ball.

    away: whether the arm may be elsewhere; set it when a swing is requested.
    """

    def __init__(
        self, config: RobotConfig, repertoire: Repertoire, ask: Callable[[m.Goal], object], log: logging.Logger
    ) -> None:
        self.away = False
        self._config = config
        self._repertoire = repertoire
        self._send = ask
        self._log = log
        self._goal_id: str | None = None
        self._next = -math.inf

    def go(self, now: float, names: Iterator[str], primitives: tuple[str, ...]) -> None:
        """Request the return, with the next goal id of `names`, unless the arm is in the ready pose or returning."""
        if not self.away or self._goal_id or now < self._next:
            return
        self._goal_id, self._next = next(names), now + RETRY_S
        primitive = self._repertoire.home or self._repertoire.nearest(READY_S, primitives)
        self._send(ready_goal(self._goal_id, self._config, primitive))

    def answered(self, goal_id: str, reply: Reply) -> bool:
        """Process the reply to a goal; return whether the goal was a return."""
        if goal_id != self._goal_id:
            return False
        self._goal_id = None
        if isinstance(reply, Taken):
            self.away, self._next = False, -math.inf
        else:
            self._log.warning("cannot go to the ready pose: %s; tries again in %.0f s", reply, RETRY_S)
        return True

    def forget(self) -> None:
        """Forget pending requests, after a new run."""
        self.away, self._goal_id, self._next = True, None, -math.inf
