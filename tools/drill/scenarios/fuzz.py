"""Thousands of mutated messages on every key: nothing ends, nothing moves, every refusal has its code."""

import random
from collections import Counter
from collections.abc import Callable

from protocol import topics
from protocol.codec import decode
from protocol.errors import CODES, Refusal
from tools.drill.harness.cell import Cell
from tools.drill.harness.lab import Lab
from tools.drill.harness.mutations import mutate
from tools.drill.harness.start import ARM, Plan
from tools.drill.harness.valid_bodies import good_publications, good_requests, renewed
from tools.drill.scenario import Measured, Scenario, at_least, exactly, none, told
from tools.drill.scenarios.messages import answer, publish, unmoved

MESSAGES, LONG_MESSAGES = 5_000, 100_000
LOOK_EVERY = 10
READ = {query.key for query in topics.QUERIES if query.reads}
"""What changes nothing, and needs no new run."""

LEADING = (topics.STATE, topics.COMMAND)
SEED = 20_26


def fuzz(lab: Lab) -> Measured:
    """Send mutated requests and publications one after another; look every ten whether the arm stands where it stood.

    A mutated request that is still good may be taken, and then a new run begins. A mutated state or command that is
    still good is not sent: who may publish them is for the permissions to say.
    """
    plan = Plan(names=(*ARM, "recorder"), flags={"record": lab.folder / "fuzz.rrd"})
    with lab.cell(plan) as cell:
        cell.reset()
        return fuzz_cell(cell, LONG_MESSAGES if lab.long else MESSAGES, lab.say)


def fuzz_cell(cell: Cell, count: int, say: Callable[[str], object]) -> Measured:
    """Send `count` messages."""
    rng, requests, said = random.Random(SEED), good_requests(cell), good_publications(cell)
    codes: Counter[str] = Counter()
    sent = moved = ended = forged = 0
    while sent < count:
        key, right = rng.choice([*requests, *said.items()])
        if isinstance(key, topics.Publication):
            body = mutate(right, rng)
            good = is_good(body, key)
            if good and key in LEADING:
                continue
            forged += good
            publish(cell, key, [body])
        else:
            code = answer(cell, key, mutate(renewed(cell, key, right), rng))
            codes[code] += 1
            if code == "taken" and key not in READ:
                cell.reset()
        sent += 1
        if sent % LOOK_EVERY == 0:
            say(f"{sent} of {count} messages")
            found = unmoved(cell)
            moved += int(found["positions away from home"])
            ended = max(ended, int(found["processes ended"]))
            cell.reset()
    return {
        "messages": sent,
        "publications sent": sent - codes.total(),
        "publications still good": forged,
        "requests still good, taken": codes["taken"],
        "requests refused": sum(codes[code] for code in CODES),
        "refusals without a code of the table": codes.total() - codes["taken"] - sum(codes[code] for code in CODES),
        "times the arm moved": moved,
        "processes ended": ended,
        "a good goal afterwards": cell.finish(cell.goal(duration=0.5)).outcome,
    }


def is_good(body: bytes, topic: topics.Publication) -> bool:
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
            told("requests still good, taken"),
            at_least("publications sent", 1000),
            told("publications still good"),
            none("refusals without a code of the table"),
            none("times the arm moved"),
            none("processes ended"),
            exactly("a good goal afterwards", "succeeded"),
        ),
        fuzz,
    ),
)
