"""Thousands of mutated messages on every key: no process ends, nothing moves, every refusal has its code."""

import random
from collections import Counter
from collections.abc import Callable

from protocol import topics
from protocol.codec import decode
from protocol.errors import CODES, Refusal
from tools.drill.harness.cell import ACCEPTED, Cell
from tools.drill.harness.lab import Lab
from tools.drill.harness.mutations import mutate
from tools.drill.harness.raw import answer, publish, unmoved
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.valid_bodies import renewed, valid_publications, valid_requests
from tools.drill.scenario import Measured, Scenario, at_least, exactly, none, reported

MESSAGES, LONG_MESSAGES = 5_000, 100_000
CHECK_EVERY = 10
READ = {query.key for query in topics.QUERIES if query.reads}
"""Requests that change nothing, so that no new run must begin."""

LEADING = (topics.STATE, topics.COMMAND)
SEED = 20_26


def fuzz(lab: Lab) -> Measured:
    """Send mutated requests and publications one after another; check after every ten that the arm has not moved.

    A mutated request that is still valid may be accepted; then a new run begins. A mutated state or command that is
    still valid is not sent, because certificates decide who may publish them.
    """
    config = CellConfig(names=(*ARM, "recorder", "striker"), flags={"record": lab.folder / "fuzz.rrd"})
    with lab.cell(config) as cell:
        cell.reset()
        return fuzz_cell(cell, LONG_MESSAGES if lab.long else MESSAGES, lab.progress)


def fuzz_cell(cell: Cell, count: int, progress: Callable[[str], object]) -> Measured:
    """Send `count` messages."""
    rng, requests, messages = random.Random(SEED), valid_requests(cell), valid_publications(cell)
    codes: Counter[str] = Counter()
    sent = moved = ended = forged = 0
    while sent < count:
        key, valid_body = rng.choice([*requests, *messages.items()])
        if isinstance(key, topics.Publication):
            body = mutate(valid_body, rng)
            valid = is_valid(body, key)
            if valid and key in LEADING:
                continue
            forged += valid
            publish(cell, key, [body])
        else:
            code = answer(cell, key, mutate(renewed(cell, key, valid_body), rng))
            codes[code] += 1
            if code == ACCEPTED and key not in READ:
                cell.reset()
        sent += 1
        if sent % CHECK_EVERY == 0:
            progress(f"{sent} of {count} messages")
            found = unmoved(cell)
            moved += int(found["positions away from home"])
            ended = max(ended, int(found["processes ended"]))
            cell.reset()
    return {
        "messages": sent,
        "publications sent": sent - codes.total(),
        "mutants that are valid publications": forged,
        "mutants that are valid requests, accepted": codes[ACCEPTED],
        "requests refused": sum(codes[code] for code in CODES),
        "refusals without a code of the table": codes.total() - codes[ACCEPTED] - sum(codes[code] for code in CODES),
        "times the arm moved": moved,
        "processes ended": ended,
        "a valid goal afterwards": cell.finish(cell.goal(duration=0.5)).outcome,
    }


def is_valid(body: bytes, topic: topics.Publication) -> bool:
    """Whether a body is a message of the topic."""
    try:
        decode(body, topic.message, 1 << 24)
    except Refusal:
        return False
    return True


SCENARIOS = (
    Scenario(
        "fuzz",
        "5,000 mutated messages on all keys (100,000 with --long)",
        "stepped",
        (
            at_least("messages", MESSAGES),
            at_least("requests refused", 1000),
            reported("mutants that are valid requests, accepted"),
            at_least("publications sent", 1000),
            reported("mutants that are valid publications"),
            none("refusals without a code of the table"),
            none("times the arm moved"),
            none("processes ended"),
            exactly("a valid goal afterwards", "succeeded"),
        ),
        fuzz,
    ),
)
