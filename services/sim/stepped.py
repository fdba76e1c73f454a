"""The clock `stepped`: time advances on request only."""

import threading
import time
from collections.abc import Sequence

from services.common.robot_side.clocks import IDLE_S, step_all
from services.common.robot_side.controller_presence import HANG_S
from services.sim.loop import SimLoop


def run_stepped(loops: Sequence[SimLoop], stopping: threading.Event) -> None:
    """Run with steps on request, each after the answer to the present tick, until `stopping` is set."""
    while not stopping.is_set():
        asked = next((loop for loop in loops if loop.deferred is not None), None)
        late = [loop for loop in loops if not _is_answered(loop, asked)]
        if asked is not None and asked.deferred is not None and asked.left > 0 and not late:
            step_all(loops)
            asked.deferred.deadline = time.monotonic() + HANG_S
        else:
            for loop in late or loops:
                if (taken := loop.commands.take(IDLE_S if asked else 0.0)) is not None:
                    loop.receive(taken)
        for loop in loops:
            loop.attend(0.0 if asked else IDLE_S)


def _is_answered(loop: SimLoop, asked: SimLoop | None) -> bool:
    """Return whether the present tick is answered; other arms than the requested one may have no controller."""
    return loop.is_answered(loop.backend.observe().tick) or (loop is not asked and loop.drive.answered_tick < 0)
