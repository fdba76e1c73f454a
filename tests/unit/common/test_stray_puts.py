"""Requests that were sent as publications instead of queries."""

import logging

import pytest

from services.common.stray_puts import StrayPuts


class FakeBus:
    """A bus with requests that were sent as publications."""

    def __init__(self) -> None:
        self.puts: list[str] = []

    def take_puts(self) -> list[str]:
        """Return each of them once."""
        puts, self.puts = self.puts, []
        return puts


def test_a_goal_sent_as_publication_is_logged(caplog: pytest.LogCaptureFixture):
    """The log has the key and a remedy."""
    bus = FakeBus()
    watch = StrayPuts(bus, logging.getLogger("planner"))  # type: ignore[arg-type]
    watch.warn()
    assert not caplog.records
    bus.puts.append("volley/arm/goal")
    watch.warn()
    assert "something was put on volley/arm/goal and did nothing; send a request as a query" in caplog.text
