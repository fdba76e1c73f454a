"""Bodies of any bytes, sent to a cell on the stepped clock, and whether the arm stayed where it was."""

from collections.abc import Iterable

import zenoh

from protocol import topics
from tools.drill.harness.cell import Cell
from tools.drill.harness.flood import ANSWER_S, SILENT, code_in
from tools.drill.harness.waiting import ScenarioError
from tools.drill.scenario import Measured, none

AT_HOME = 1e-6
"""rad; the arm has moved if it is further from home than this."""
HOLD_TICKS = 20
TIMEOUTS_S = {query.key: query.timeout_s for query in topics.QUERIES}

UNMOVED = (none("positions away from home"), none("processes ended"))


def answer(cell: Cell, key: str, body: bytes) -> str:
    """Send a body as a request and return the code of the refusal, or `accepted`.

    Raises:
        ScenarioError: no reply within the timeout of the key, or 20 s if that is longer: the machine may be busy.
    """
    timeout = max(TIMEOUTS_S.get(key, 0.0), ANSWER_S)
    for reply in cell.bus.session.get(cell.bus.key(key), payload=body, timeout=timeout):
        if (code := code_in(reply)) not in (None, SILENT):
            return str(code)
    raise ScenarioError(f"{key} did not answer within {timeout:g} s: {len(body)} bytes, first {body[:80]!r}")


def publish(cell: Cell, topic: topics.Publication, bodies: Iterable[bytes]) -> int:
    """Publish bodies as a foreign session would, in order and without dropping any; return how many."""
    count = 0
    for body in bodies:
        cell.bus.session.put(cell.bus.key(topic.key), body, congestion_control=zenoh.CongestionControl.BLOCK)
        count += 1
    return count


def unmoved(cell: Cell) -> Measured:
    """Let the arm hold for 20 ticks; return what `UNMOVED` bounds."""
    cell.step(HOLD_TICKS)
    far = max(abs(x - y) for state in cell.states() for x, y in zip(state.positions, cell.home, strict=True))
    return {"positions away from home": int(far > AT_HOME), "processes ended": cell.processes.ended()}
