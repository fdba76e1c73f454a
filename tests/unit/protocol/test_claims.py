"""Two services that claim the same place on the bus at once: one of them succeeds."""

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
import zenoh

from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from tools.drill.harness.waiting import PATIENCE_S, eventually


class Claimant(Bus):
    """A bus whose claim waits for `may_look` before it queries rivals and for `may_act` before it acts on them."""

    def __init__(self, session: zenoh.Session) -> None:
        super().__init__(session)
        self.may_look, self.has_looked, self.may_act = threading.Event(), threading.Event(), threading.Event()

    def rivals(self, service: str) -> set[str]:
        """Query rivals once permitted, and return them once permitted."""
        assert self.may_look.wait(PATIENCE_S)
        seen = super().rivals(service)
        self.has_looked.set()
        assert self.may_act.wait(PATIENCE_S)
        return seen


@pytest.fixture
def claimants(router: Bus, endpoint: str) -> Iterator[list[Claimant]]:
    """Two claimants, the one with the smaller id first."""
    with Claimant(open_session(connect=[endpoint])) as one, Claimant(open_session(connect=[endpoint])) as other:
        yield sorted((one, other), key=lambda claimant: str(claimant.session.zid()))


@pytest.mark.parametrize("attempt", range(6))
def test_of_two_simultaneous_claims_the_smaller_id_succeeds(router, claimants, attempt):
    """Both have declared before either queries, so one waits for the other to withdraw."""
    with ThreadPoolExecutor(2) as pool:
        claims = [pool.submit(each.claim, "sim", PATIENCE_S) for each in claimants]
        assert eventually(lambda: len(router.rivals("sim")) == 2)
        for each in claimants:
            each.may_look.set()
            each.may_act.set()
        assert [claim.result() for claim in claims] == [True, False]


def test_of_two_simultaneous_claims_that_stall_one_succeeds(router, claimants):
    """The smaller id times out and withdraws. The larger one withdraws too, queries again, and succeeds."""
    smaller, larger = claimants
    with ThreadPoolExecutor(2) as pool:
        claims = [pool.submit(each.claim, "sim", 0.0) for each in claimants]
        assert eventually(lambda: len(router.rivals("sim")) == 2)
        larger.may_look.set()
        assert larger.has_looked.wait(PATIENCE_S)
        smaller.may_look.set()
        smaller.may_act.set()
        assert not claims[0].result()
        larger.may_act.set()
        assert claims[1].result()
        assert eventually(lambda: len(router.rivals("sim")) == 1)


def test_a_later_claim_fails(router, endpoint):
    """With a larger id, and with a smaller one, which waits for the other to withdraw."""
    buses = [Bus(open_session(connect=[endpoint])) for _ in range(3)]
    with buses[0], buses[1], buses[2]:
        smaller, holder, larger = sorted(buses, key=lambda bus: str(bus.session.zid()))
        assert holder.claim("sim")
        assert not larger.claim("sim", timeout=PATIENCE_S)
        assert not smaller.claim("sim", timeout=0.1)
