"""The recorder: a writer for each topic, called in batches."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from protocol import topics
from protocol.topics import Publication
from robot.description import RobotConfig
from services.recorder import entities
from services.recorder.blueprint import style
from services.recorder.context import Context
from services.recorder.entities import Entity
from services.recorder.events import (
    BallWriter,
    StatusWriter,
    SurroundingsWriter,
    write_contacts,
    write_refusals,
    write_results,
)
from services.recorder.plans import PlanWriter
from services.recorder.pushes import DisturbanceWriter
from services.recorder.runs import Runs
from services.recorder.streams import CommandWriter, StateWriter
from services.recorder.strikes import StrikeWriter
from services.recorder.validation import Received, Receiver, Source
from services.recorder.writer import TraceWriter

BATCH_S = 0.5
"""Period of the batches, s: each costs a few hundred calls of Rerun, whatever its size."""

MAX_COMPLAINTS = 20
"""Number of malformed messages that are logged; all are counted."""


def topic_writers(context: Context) -> dict[Publication, Callable[[list[Received[Any]]], None]]:
    """Return what writes a batch of each recorded topic, in the order of writing; it is called without messages, too.

    The states are first, because they carry the time.
    """
    plans = PlanWriter(context)
    return {
        topics.STATE: StateWriter(context).write,
        topics.COMMAND: CommandWriter(context).write,
        topics.PLAN: plans.write,
        topics.REFUSED: partial(write_refusals, context),
        topics.STATUS: StatusWriter(context).write,
        topics.ENDED: partial(write_results, context, plans.end),
        topics.CONTACT: partial(write_contacts, context),
        topics.BALL: BallWriter(context).write,
        topics.STRIKES: StrikeWriter(context).write,
        topics.SCENE: SurroundingsWriter(context).write,
        topics.DISTURBANCE: DisturbanceWriter(context).write,
    }


class Recorder:
    """Writes the messages that arrived since the last batch."""

    def __init__(
        self, config: RobotConfig, trace: TraceWriter, sources: Mapping[Publication, Source], log: logging.Logger
    ) -> None:
        self._log = log
        self._complaints = 0
        self._counts: dict[Entity, int] = {}
        self._context = Context(trace, config)
        self._receiver = Receiver(sources, config.joint_count, self._complain)
        self._writers = topic_writers(self._context)
        self._context.scene.write_geometry(trace)
        style(trace, config.joint_names)

    def run(self, stopping: threading.Event) -> None:
        """Write a batch twice a second until `stopping` is set, then the rest."""
        while not stopping.wait(BATCH_S):
            self.write_batch()
        self.write_batch()
        if sum(self._counts.values()):
            counts = ", ".join(f"{count} {_label(entity)}" for entity, count in self._counts.items())
            self._log.warning("not in the trace: %s", counts)

    @property
    def runs(self) -> Runs:
        """The runs in the trace, and the progress of the newest."""
        return self._context.runs

    def write_batch(self) -> None:
        """Write the messages that have arrived."""
        batch = self._receiver.take()
        self._context.scene.expect([(one.message.time, one.message.joints) for one in batch[topics.SCENE]])
        for topic, write in self._writers.items():
            write(batch[topic])
        self._write_count(entities.STATES_MISSING, self._context.runs.missing_states)
        self._write_count(entities.COMMANDS_MISSING, self._context.runs.missing_commands)
        self._write_count(entities.MALFORMED, self._receiver.malformed)

    def _write_count(self, entity: Entity, number: int) -> None:
        """Write how many messages the trace lacks if the number has changed, and log it the first time."""
        before = self._counts.get(entity)
        if number == before:
            return
        self._counts[entity] = number
        what, row = _label(entity), self._context.row_at(time.time_ns())
        self._context.trace.scalars(entity.path, row, [number])
        if number:
            sentence = f"{number - (before or 0)} more {what}, {number} in all"
            self._context.event(entities.RECORDER_EVENT, row, sentence, "WARN")
        if number and not before:
            self._log.warning("%d %s; the trace counts them", number, what)

    def _complain(self, sentence: str, code: str) -> None:
        self._complaints += 1
        if self._complaints <= MAX_COMPLAINTS:
            self._log.warning("%s", sentence, extra={"code": code})


def _label(entity: Entity) -> str:
    """Return the last part of an entity's path as words, for example `states missing`."""
    return entity.path.rpartition("/")[2].replace("_", " ")
