"""The striker's publications and log lines about each ball."""

import contextlib
import logging
from collections.abc import Callable

from protocol import messages as m
from protocol.errors import NoAnswer, Refusal
from robot.striking.choice import NoHit
from robot.striking.estimator import Estimator, NoBall
from services.striker.attempt import Attempt
from services.striker.messages import strike_message
from services.striker.outcomes import Outcome

PREDICTION_S = 1.0
"""Length of the published prediction of a ball without a hit, s."""
PREDICTED = ("seen", "planned", "revised", "refused")
"""Phases with a published prediction."""


class DecisionPublisher:
    """Publishes decisions with `send`, each with the ball's prediction, and logs all but corrections."""

    def __init__(self, send: Callable[[m.Strike], object], estimator: Estimator, log: logging.Logger) -> None:
        self._send = send
        self._estimator = estimator
        self._log = log

    def publish(
        self, attempt: Attempt, phase: m.StrikePhase, now: float, reason: str = "", outcome: Outcome | None = None
    ) -> None:
        """Publish a decision at `now` (s)."""
        level = logging.WARNING if phase in ("refused", "missed") else logging.INFO
        if phase != "revised":
            self._log.log(level, "ball %d %s%s", attempt.ball, phase, f": {reason}" if reason else "")
        path = None
        if phase in PREDICTED:
            until = attempt.choice.time if attempt.choice else now + PREDICTION_S
            with contextlib.suppress(NoBall):
                path = self._estimator.path(until)
        self._send(strike_message(attempt, phase, now, path, reason, outcome))

    def publish_refusal(self, attempt: Attempt, now: float, reason: NoHit | Refusal | NoAnswer) -> None:
        """Publish why no hit, or no correction, is played; once for consecutive reasons of the same kind."""
        kind = reason.reason if isinstance(reason, NoHit) else reason.code if isinstance(reason, Refusal) else "silence"
        attempt.reason = str(reason)
        if kind != attempt.reason_kind:
            attempt.reason_kind = kind
            self.publish(attempt, "refused", now, str(reason))

    def end_without_hit(self, attempt: Attempt, now: float, reason: str) -> None:
        """End an attempt without a hit, and publish why."""
        self.publish(attempt, "missed", now, reason)
        attempt.stage, attempt.pending = "over", None
