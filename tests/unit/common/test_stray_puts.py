"""Requests that were put instead of queried."""

import logging

import pytest

from services.common.stray_puts import StrayPuts


class FakeBus:
    """A bus on which requests were put."""

    def __init__(self) -> None:
        self.puts: list[str] = []

    def take_puts(self) -> list[str]:
        """Return each of them once."""
        puts, self.puts = self.puts, []
        return puts


def test_a_goal_that_was_put_is_logged(caplog: pytest.LogCaptureFixture):
    """The log names the key and what to do instead."""
    bus = FakeBus()
    watch = StrayPuts(bus, logging.getLogger("planner"))  # type: ignore[arg-type]
    watch.warn()
    assert not caplog.records
    bus.puts.append("volley/arm/goal")
    watch.warn()
    assert "something was put on volley/arm/goal and did nothing; send a request as a query" in caplog.text
