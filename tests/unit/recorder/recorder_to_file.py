"""A recorder that writes into a file, with fake subscriptions."""

import logging
from pathlib import Path

import numpy as np

from protocol import messages as m
from protocol.codec import encode
from protocol.topics import PUBLICATIONS, Publication
from robot.description import load_robot
from services.recorder.blueprint import build_blueprint
from services.recorder.recorder import Recorder
from services.recorder.writer import TraceWriter
from tests.unit.recorder.recorder_messages import JOINTS, FakeStream
from tools.trace_reader import Trace, read_trace

RECORDED = tuple(topic for topic in PUBLICATIONS if topic.recorded)
CONFIG = load_robot()
LOG = logging.getLogger("test")


class RecorderToFile:
    """A recorder with fake subscriptions that writes into a file."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._writer = TraceWriter(build_blueprint(CONFIG, live=False), file, None)
        self._sources = {topic: FakeStream() for topic in RECORDED}
        self._recorder = Recorder(CONFIG, self._writer, self._sources, LOG)

    def publish(self, topic: Publication, *messages: m.Message, at: int = 1) -> None:
        """Publish messages, received at `at` Unix ns."""
        self._sources[topic].extend((encode(message), at) for message in messages)

    def publish_bytes(self, topic: Publication, body: bytes) -> None:
        """Publish a body of any bytes."""
        self._sources[topic].append((body, 1))

    def end_batch(self) -> None:
        """Write the messages published since the last batch."""
        self._recorder.write_batch()

    def read(self) -> Trace:
        """End the last batch and the trace, and read it back."""
        self.end_batch()
        self._writer.close()
        return read_trace(self._file)


def joints(trace: Trace, path: str) -> np.ndarray:
    """Return the scalars (N, J) of an entity that exists for each joint."""
    return np.stack([trace.scalars(path.format(name)) for name in JOINTS], axis=1)
