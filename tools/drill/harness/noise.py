"""Random bytes on the keys of publications."""

import os
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import zenoh

from protocol import topics
from protocol.bus.sessions import open_session
from tools.drill.harness.cell import Cell

BODY_BYTES = 1000
BYTES_PER_S = 1e6


@contextmanager
def noisy(cell: Cell, where: Sequence[topics.Publication] = topics.PUBLICATIONS) -> Iterator[list[int]]:
    """Publish 1 MB/s of noise until the block ends; yield a list with the number of messages sent so far."""
    sent, stopping = [0], threading.Event()

    def publish(session: zenoh.Session, keys: list[str]) -> None:
        began = time.monotonic()
        while not stopping.wait(0.005):
            while sent[0] * BODY_BYTES < BYTES_PER_S * (time.monotonic() - began):
                session.put(keys[sent[0] % len(keys)], os.urandom(BODY_BYTES))
                sent[0] += 1

    keys = [cell.bus.key(topic.key) for topic in where]
    with open_session([cell.endpoint]) as session:
        thread = threading.Thread(target=publish, args=(session, keys))
        thread.start()
        try:
            yield sent
        finally:
            stopping.set()
            thread.join()
