"""Writer of bodies that move without the arm: loose objects, other arms."""

import time

import numpy as np
import rerun as rr

from protocol import messages as m
from services.recorder import entities
from services.recorder.context import Context
from services.recorder.validation import Received
from services.recorder.writer import Rows


class SurroundingsWriter:
    """Writes the poses of bodies that only joints other than the arm's move."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._begun = False

    def write(self, received: list[Received[m.Scene]]) -> None:
        """Write every message, and at the first state the model's poses."""
        context = self._context
        if not context.scene.others:
            return
        if not self._begun and context.runs.count:
            self._begun = True
            self._write(context.row(0, time.time_ns()), [context.scene.other_poses({})])
        if received:
            rows = context.rows([context.runs.tick_at(one.message.time) for one in received], received)
            self._write(rows, [context.scene.other_poses(one.message.joints) for one in received])

    def _write(self, rows: Rows, poses: list[tuple[np.ndarray, np.ndarray]]) -> None:
        for index, body in enumerate(self._context.scene.others):
            columns = rr.Transform3D.columns(
                translation=[places[index] for places, _ in poses], quaternion=[turns[index] for _, turns in poses]
            )
            self._context.trace.send(entities.BODY.at(self._context.scene.names[body]), rows, columns)
