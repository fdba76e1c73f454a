"""What the planner logs of the controller."""

import logging
from collections.abc import Callable

import msgspec
import pytest

from protocol import messages as m
from protocol.codec import encode
from services.planner.watch import ControllerWatch
from tests.golden.examples import EXAMPLES


class Heard:
    """A bus on which only this test publishes."""

    def listen(self, _: object, callback: Callable[[bytes], object]) -> None:
        """Keep what wants to hear."""
        self.say = callback


def status(fault: str | None) -> bytes:
    """Return a status."""
    example = EXAMPLES["Status"]
    assert isinstance(example, m.Status)
    return encode(msgspec.structs.replace(example, fault=fault))


def test_every_change_is_logged_once(caplog: pytest.LogCaptureFixture):
    """Present, in fault, out of it, silent, back: one line each, however often the watch looks."""
    caplog.set_level(logging.INFO)
    bus, heard = Heard(), list[m.Status]()
    watch = ControllerWatch(bus, logging.getLogger("planner"), heard.append)  # type: ignore[arg-type]
    watch.look(0.0)
    watch.look(9.0)
    assert caplog.messages == []
    for k, fault in enumerate([None, None, "hot", "hot", None]):
        bus.say(status(fault))
        watch.look(10.0 + k / 10)
    watch.look(10.8)
    assert "fell silent" not in caplog.text
    watch.look(11.0)
    watch.look(12.0)
    bus.say(status(None))
    watch.look(13.0)
    words = ["is there", "in fault: hot", "left its fault", "fell silent", "is there"]
    assert len(caplog.messages) == len(words)
    assert all(word in line for word, line in zip(words, caplog.messages, strict=True))
    assert [status.fault for status in heard] == [None, None, "hot", "hot", None, None]


def test_noise_is_no_sign_of_life(caplog: pytest.LogCaptureFixture):
    """Noise does not replace a status that arrived just before it either."""
    caplog.set_level(logging.INFO)
    bus, heard = Heard(), list[m.Status]()
    watch = ControllerWatch(bus, logging.getLogger("planner"), heard.append)  # type: ignore[arg-type]
    bus.say(status("hot"))
    bus.say(b"\xc1")
    watch.look(10.0)
    assert "in fault: hot" in caplog.text
    assert len(heard) == 1
    for k in range(1, 10):
        bus.say(b"\xc1")
        watch.look(10.0 + k / 10)
    assert "fell silent" in caplog.text
