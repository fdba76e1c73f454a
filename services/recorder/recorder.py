"""The recorder itself: every topic's drawer, fed in batches."""

import logging
import threading
import time
from collections.abc import Mapping

from protocol import topics
from protocol.topics import Publication
from robot.description import RobotConfig
from services.recorder.blueprint import style
from services.recorder.context import Canvas, Drawer
from services.recorder.events import (
    BallDrawer,
    ContactDrawer,
    DisturbanceDrawer,
    EndedDrawer,
    RefusedDrawer,
    StatusDrawer,
)
from services.recorder.plans import PlanDrawer
from services.recorder.streams import CommandDrawer, StateDrawer
from services.recorder.validation import Intake, Source
from services.recorder.writer import TraceWriter

BATCH_S = 0.5
"""Each batch costs the same some hundred calls of Rerun, however much is in it."""

MAX_COMPLAINTS = 20
"""Malformed messages told of in the log; all are counted."""


def build_drawers(canvas: Canvas) -> dict[Publication, Drawer]:
    """One drawer for each recorded topic, in the order in which a batch is drawn: states first, they carry the time."""
    plans = PlanDrawer(canvas)
    return {
        topics.STATE: StateDrawer(canvas),
        topics.COMMAND: CommandDrawer(canvas),
        topics.PLAN: plans,
        topics.REFUSED: RefusedDrawer(canvas),
        topics.STATUS: StatusDrawer(canvas),
        topics.ENDED: EndedDrawer(canvas, plans.cut),
        topics.CONTACT: ContactDrawer(canvas),
        topics.BALL: BallDrawer(canvas),
        topics.DISTURBANCE: DisturbanceDrawer(canvas),
    }


class Recorder:
    """Takes what came in since the last batch and has it drawn."""

    def __init__(
        self, config: RobotConfig, trace: TraceWriter, sources: Mapping[Publication, Source], log: logging.Logger
    ) -> None:
        self._log = log
        self._complaints = 0
        self._counts: dict[str, int] = {}
        self._canvas = Canvas(trace, config)
        self._intake = Intake(sources, config.joint_count, self._complain)
        self._drawers = build_drawers(self._canvas)
        self._canvas.scene.draw(trace)
        style(trace, config.joint_names)

    def run(self, stopping: threading.Event) -> None:
        """Draw a batch twice a second until `stopping` is set, then what is left."""
        while not stopping.wait(BATCH_S):
            self.draw()
        self.draw()
        if sum(self._counts.values()):
            self._log.warning("not in the trace: %s", ", ".join(f"{n} {what}" for what, n in self._counts.items()))

    @property
    def newest(self) -> int:
        """The newest tick in the trace, −1 before the first."""
        return self._canvas.lives.newest

    def draw(self) -> None:
        """Draw what has come in."""
        taken = self._intake.take()
        for topic, drawer in self._drawers.items():
            drawer.draw(taken[topic])
        lives = self._canvas.lives
        self._count("states missing", lives.missing_states)
        self._count("commands missing", lives.missing_commands)
        self._count("messages malformed", self._intake.malformed)

    def _count(self, what: str, number: int) -> None:
        """Show in the trace, and the first time in the log, what is not in it."""
        before = self._counts.get(what)
        if number == before:
            return
        self._counts[what] = number
        row = self._canvas.now(time.time_ns())
        self._canvas.trace.scalars(f"/recorder/{what.replace(' ', '_')}", row, [number])
        if number:
            self._canvas.event("recorder", row, f"{number - (before or 0)} more {what}, {number} in all", "WARN")
        if number and not before:
            self._log.warning("%d %s; the trace counts them", number, what)

    def _complain(self, sentence: str, code: str) -> None:
        self._complaints += 1
        if self._complaints <= MAX_COMPLAINTS:
            self._log.warning("%s", sentence, extra={"code": code})
