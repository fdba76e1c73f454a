"""A router on a free endpoint of loopback."""

from collections.abc import Iterator

import pytest

from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from services.common.cli import free_endpoint


@pytest.fixture
def endpoint() -> str:
    """A free endpoint on loopback."""
    return free_endpoint()


@pytest.fixture
def router(endpoint: str) -> Iterator[Bus]:
    with Bus(open_session(listen=[endpoint])) as bus:
        yield bus
