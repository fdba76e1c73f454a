"""Check trajectories in a thread beside the loop, which then only splices them."""

import logging
import threading
from collections.abc import Callable

from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox
from protocol.errors import Refusal
from protocol.topics import QUEUE_LENGTH
from robot.description import RobotConfig
from services.common.refusing import refusing
from services.common.stray_puts import StrayPuts
from services.controller.checks import Checked, check_trajectory

POLL_S = 0.2
"""Longest wait for a request before the thread checks whether it must end, and for stray puts."""


class TrajectoryChecker:
    """Decodes and checks the bodies of `execute`; refuses invalid trajectories, and queues valid ones.

    Attributes:
        requests: Queue of the requests from the bus.
    """

    def __init__(
        self, config: RobotConfig, stray_puts: StrayPuts, log: logging.Logger, wake: Callable[[], object]
    ) -> None:
        """Prepare; `wake` is called when a checked trajectory is available."""
        self.requests: Inbox[PendingQuery] = Inbox()
        self._config = config
        self._stray_puts = stray_puts
        self._log = log
        self._checked: Inbox[tuple[PendingQuery, Checked]] = Inbox(wake=wake)
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="checker", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """End the thread, after the present check."""
        self._closed.set()
        self._thread.join(1.0)

    def take(self) -> tuple[PendingQuery, Checked] | None:
        """Return the oldest request with a valid trajectory, or None."""
        return self._checked.take()

    def _run(self) -> None:
        while not self._closed.is_set():
            query = self.requests.take(POLL_S)
            self._stray_puts.warn()
            if query is not None:
                with refusing(query, "controller", self._log, joints=self._config.joint_names):
                    self._check(query)

    def _check(self, query: PendingQuery) -> None:
        checked = check_trajectory(query.decode(), self._config)
        if not self._checked.offer((query, checked)):
            sentence = f"controller has {QUEUE_LENGTH} trajectories waiting; send this one again later"
            raise Refusal("busy", sentence, goal_id=checked.message.goal_id)
