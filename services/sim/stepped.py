"""The clock `stepped`: time passes on request only."""

import threading
import time

from services.common.robot_side.clocks import IDLE_S
from services.common.robot_side.controller_presence import HANG_S
from services.sim.loop import SimLoop


def run_stepped(loop: SimLoop, stopping: threading.Event) -> None:
    """Step only while a request asks for it, and only once the present tick is answered, until `stopping` is set."""
    while not stopping.is_set():
        waits = loop.deferred is not None
        tick = loop.backend.observe().tick
        if loop.deferred is not None and tick < loop.target and loop.is_answered(tick):
            loop.step()
            loop.publish()
            loop.deferred.deadline = time.monotonic() + HANG_S
        elif (taken := loop.commands.take(IDLE_S if waits else 0.0)) is not None:
            loop.receive(taken)
        loop.attend(0.0 if waits else IDLE_S)
