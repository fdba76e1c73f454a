"""Arbitrary bytes sent to a cell on the stepped clock, and a check that the arm has not moved."""

from collections.abc import Iterable

import zenoh

from protocol import topics
from tools.drill.harness.cell import Cell
from tools.drill.harness.flood import ANSWER_S, NO_REPLY, code_in
from tools.drill.harness.waiting import ScenarioError
from tools.drill.scenario import Measured, none

AT_HOME = 1e-6
"""Largest distance from home of an arm that has not moved, rad."""
HOLD_TICKS = 20

UNMOVED = (none("movements of the arm"), none("processes that exited"))


def answer(cell: Cell, key: str, body: bytes) -> str:
    """Send a body as a request and return the code of its refusal, or `accepted`.

    Raises:
        ScenarioError: no reply.
    """
    for reply in cell.bus.session.get(cell.bus.key(key), payload=body, timeout=ANSWER_S):
        if (code := code_in(reply)) not in (None, NO_REPLY):
            return str(code)
    raise ScenarioError(f"{key} did not answer within {ANSWER_S:g} s: {len(body)} bytes, first {body[:80]!r}")


def publish(cell: Cell, topic: topics.Publication, bodies: Iterable[bytes]) -> int:
    """Publish bodies in order, without dropping any under congestion; return their number."""
    count = 0
    for body in bodies:
        cell.bus.session.put(cell.bus.key(topic.key), body, congestion_control=zenoh.CongestionControl.BLOCK)
        count += 1
    return count


def check_unmoved(cell: Cell) -> Measured:
    """Step 20 ticks, and return the measurements that `UNMOVED` bounds."""
    cell.step(HOLD_TICKS)
    far = max(abs(x - y) for state in cell.states() for x, y in zip(state.positions, cell.home, strict=True))
    return {"movements of the arm": int(far > AT_HOME), "processes that exited": cell.processes.ended()}
