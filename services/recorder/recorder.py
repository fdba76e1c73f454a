"""The recorder itself: every topic's drawer, fed in batches."""

import logging
import threading
import time

from protocol import topics
from protocol.bus import Bus
from protocol.topics import Publication
from services.recorder.blueprint import style
from services.recorder.canvas import Canvas, Drawer
from services.recorder.happenings import BallDrawer, ContactDrawer, DisturbanceDrawer, EndedDrawer, StatusDrawer
from services.recorder.intake import Intake
from services.recorder.plans import PlanDrawer
from services.recorder.streams import CommandDrawer, StateDrawer
from services.recorder.writer import TraceWriter
from services.robot import RobotConfig

BATCH_S = 0.2
MAX_COMPLAINTS = 20
"""Malformed messages told of in the log; all are counted."""


def build_drawers(canvas: Canvas) -> dict[Publication, Drawer]:
    """One drawer for each recorded topic, in the order in which a batch is drawn: states first, they carry the time."""
    plans = PlanDrawer(canvas)
    return {
        topics.STATE: StateDrawer(canvas),
        topics.COMMAND: CommandDrawer(canvas),
        topics.PLAN: plans,
        topics.STATUS: StatusDrawer(canvas),
        topics.ENDED: EndedDrawer(canvas, plans.cut),
        topics.CONTACT: ContactDrawer(canvas),
        topics.BALL: BallDrawer(canvas),
        topics.DISTURBANCE: DisturbanceDrawer(canvas),
    }


class Recorder:
    """Takes what came in since the last batch and has it drawn."""

    def __init__(self, config: RobotConfig, trace: TraceWriter, log: logging.Logger) -> None:
        self._log = log
        self._complaints = 0
        self._counted = (0, 0)
        self._canvas = Canvas(trace, config)
        self.intake = Intake(config.joint_count, self._complain)
        self.drawers = build_drawers(self._canvas)
        self._canvas.scene.draw(trace)
        style(trace, config.joint_names)

    def listen(self, bus: Bus) -> None:
        """Subscribe to all that is recorded."""
        self.intake.listen(bus)

    def run(self, stopping: threading.Event) -> None:
        """Draw a batch five times a second until `stopping` is set, then what is left."""
        while not stopping.wait(BATCH_S):
            self.draw()
        self.draw()

    def draw(self) -> None:
        """Draw what has come in."""
        taken = self.intake.take()
        for topic, drawer in self.drawers.items():
            drawer.draw(taken.get(topic, []))
        self._count()

    def _count(self) -> None:
        """Show in the trace and say in the log what was lost or malformed."""
        counted = (self.intake.lost, self.intake.malformed)
        if counted == self._counted:
            return
        row = self._canvas.now(time.time_ns())
        for name, now, before in zip(("lost", "malformed"), counted, self._counted, strict=True):
            self._canvas.trace.scalars(f"/recorder/{name}", row, [now])
            if now > before:
                self._canvas.event("recorder", row, f"{now - before} more messages {name}, {now} in all", "WARN")
        if counted[0] > self._counted[0]:
            self._log.warning("%d messages lost so far: they came faster than they could be written", counted[0])
        self._counted = counted

    def _complain(self, sentence: str) -> None:
        self._complaints += 1
        if self._complaints <= MAX_COMPLAINTS:
            self._log.warning("%s", sentence)
