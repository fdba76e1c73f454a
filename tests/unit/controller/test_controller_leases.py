"""The controller learns from the bus which clients hold a token."""

import logging

import pytest

from services.controller.core import Controller
from services.controller.leases import MAX_EVENTS, ClientLeases
from tests.unit.controller.stand_ins import CONFIG, FakeBus


class Setup:
    """The leases of a controller on a fake bus."""

    def __init__(self) -> None:
        self.core, self.bus = Controller(CONFIG), FakeBus()
        self.leases = ClientLeases(self.core, logging.getLogger("controller"))
        self.leases.open(self.bus)  # type: ignore[arg-type]


@pytest.fixture
def setup() -> Setup:
    return Setup()


def test_one_event_is_applied_a_step(setup: Setup):
    setup.bus.see_client("alice")
    setup.bus.see_client("bob")
    setup.bus.see_client("alice", alive=False)
    seen = []
    for _ in range(4):
        setup.leases.step()
        seen.append(set(setup.leases.clients))
    assert seen == [{"alice"}, {"alice", "bob"}, {"bob"}, {"bob"}]


def test_an_overflow_ends_every_lease(setup: Setup):
    """A lost event of the bounded queue may be that the holder has gone, so every lease ends."""
    setup.bus.see_client("alice")
    setup.leases.step()
    assert setup.leases.clients == {"alice"}
    setup.bus.see_client("bob")
    for k in range(MAX_EVENTS - 1):
        setup.bus.see_client(f"flood-{k}")
    setup.bus.see_client("bob", alive=False)  # this one is lost
    for _ in range(MAX_EVENTS + 1):
        setup.leases.step()
    assert setup.leases.clients == set()
    setup.bus.see_client("carol")
    setup.leases.step()
    assert setup.leases.clients == {"carol"}


def test_a_continued_flood_is_logged_once_a_second(setup: Setup, caplog: pytest.LogCaptureFixture):
    for _ in range(20):
        for k in range(MAX_EVENTS + 2):
            setup.bus.see_client(f"flood-{k}")
        setup.leases.step()
    assert len(caplog.records) == 1
