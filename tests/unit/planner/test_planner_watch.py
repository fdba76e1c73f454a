"""The planner's log of the controller's state."""

import logging
from collections.abc import Callable

import msgspec
import pytest

from protocol import messages as m
from protocol.codec import encode
from services.planner.watch import ControllerWatch
from tests.golden.examples import EXAMPLES


class FakeBus:
    """A bus on which only the test publishes."""

    def listen(self, _: object, callback: Callable[[bytes], object]) -> None:
        """Store the callback."""
        self.publish = callback


def status(fault: str | None) -> bytes:
    """Return an encoded status."""
    example = EXAMPLES["Status"]
    assert isinstance(example, m.Status)
    return encode(msgspec.structs.replace(example, fault=fault))


def test_every_change_of_the_controllers_state_is_logged_once(caplog: pytest.LogCaptureFixture):
    """Present, in fault, without fault, silent, present again."""
    caplog.set_level(logging.INFO)
    bus, received = FakeBus(), list[m.Status]()
    watch = ControllerWatch(bus, logging.getLogger("planner"), received.append)  # type: ignore[arg-type]
    watch.update(0.0)
    watch.update(9.0)
    assert caplog.messages == []
    for k, fault in enumerate([None, None, "hot", "hot", None]):
        bus.publish(status(fault))
        watch.update(10.0 + k / 10)
    watch.update(10.8)
    assert "fell silent" not in caplog.text
    watch.update(11.0)
    watch.update(12.0)
    bus.publish(status(None))
    watch.update(13.0)
    words = ["is there", "in fault: hot", "left its fault", "fell silent", "is there"]
    assert len(caplog.messages) == len(words)
    assert all(word in line for word, line in zip(words, caplog.messages, strict=True))
    assert [status.fault for status in received] == [None, None, "hot", "hot", None, None]


def test_malformed_statuses_do_not_count(caplog: pytest.LogCaptureFixture):
    """Neither as a sign of life nor as a replacement of the status before."""
    caplog.set_level(logging.INFO)
    bus, received = FakeBus(), list[m.Status]()
    watch = ControllerWatch(bus, logging.getLogger("planner"), received.append)  # type: ignore[arg-type]
    bus.publish(status("hot"))
    bus.publish(b"\xc1")
    watch.update(10.0)
    assert "in fault: hot" in caplog.text
    assert len(received) == 1
    for k in range(1, 10):
        bus.publish(b"\xc1")
        watch.update(10.0 + k / 10)
    assert "fell silent" in caplog.text
