"""Thousands of mutated messages on every key: no process exits, the arm does not move, every refusal has a code."""

import random
from collections import Counter
from collections.abc import Callable

from protocol import topics
from protocol.codec import decode
from protocol.errors import CODES, Refusal
from tools.drill.harness.cell import ACCEPTED, Cell
from tools.drill.harness.lab import Lab
from tools.drill.harness.mutations import mutate
from tools.drill.harness.raw import answer, check_unmoved, publish
from tools.drill.harness.shims import counts, shim
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.valid_bodies import renewed, valid_publications, valid_requests
from tools.drill.scenario import Measured, Scenario, at_least, exactly, none, reported

MESSAGES, LONG_MESSAGES = 5_000, 100_000
CHECK_EVERY = 10
READ = {query.key for query in topics.QUERIES if query.reads}
"""Requests that change nothing, after which no new run must begin."""

UNCOLLECTED = "sim", "controller", "striker"
"""Services that disable the garbage collector and never call it: an error in a reference cycle keeps its message."""

GUARDED = (topics.STATE, topics.COMMAND)
"""Topics of which no valid mutant is sent."""
SEED = 20_26


def fuzz(lab: Lab) -> Measured:
    """Send mutated requests and publications; check after every ten messages that the arm has not moved.

    After a mutant that is a valid request and is accepted a new run begins. A mutant that is a valid state or command
    is not sent, because certificates decide who may publish these.
    """
    counter = shim("kept_tracebacks", lab.folder)
    config = CellConfig(
        services=(*ARM, "recorder", "striker"),
        flags={"record": lab.folder / "fuzz.rrd"},
        shims=dict.fromkeys(UNCOLLECTED, counter),
    )
    with lab.cell(config) as cell:
        cell.reset()
        measured = fuzz_cell(cell, LONG_MESSAGES if lab.long else MESSAGES, lab.progress)
        pids = cell.processes.pids()
    kept = counts(counter, "tracebacks", pids)
    return {**measured, "processes without garbage collector": len(kept), "errors kept in them": sum(kept.values())}


def fuzz_cell(cell: Cell, count: int, progress: Callable[[str], object]) -> Measured:
    """Send `count` mutated messages, and return the measurements."""
    rng, requests, messages = random.Random(SEED), valid_requests(cell), valid_publications(cell)
    codes: Counter[str] = Counter()
    sent = moved = exited = valid_mutants = 0
    while sent < count:
        key, valid_body = rng.choice([*requests, *messages.items()])
        if isinstance(key, topics.Publication):
            body = mutate(valid_body, rng)
            valid = is_valid(body, key)
            if valid and key in GUARDED:
                continue
            valid_mutants += valid
            publish(cell, key, [body])
        else:
            code = answer(cell, key, mutate(renewed(cell, key, valid_body), rng))
            codes[code] += 1
            if code == ACCEPTED and key not in READ:
                cell.reset()
        sent += 1
        if sent % CHECK_EVERY == 0:
            progress(f"{sent} of {count} messages")
            found = check_unmoved(cell)
            moved += int(found["movements of the arm"])
            exited = max(exited, int(found["processes that exited"]))
            cell.reset()
    return {
        "messages": sent,
        "publications sent": sent - codes.total(),
        "valid mutants published": valid_mutants,
        "valid mutants accepted as requests": codes[ACCEPTED],
        "requests refused": sum(codes[code] for code in CODES),
        "refusals with an unknown code": codes.total() - codes[ACCEPTED] - sum(codes[code] for code in CODES),
        "movements of the arm": moved,
        "processes that exited": exited,
        "outcome of a valid goal afterwards": cell.finish(cell.goal(duration=0.5)).outcome,
    }


def is_valid(body: bytes, topic: topics.Publication) -> bool:
    """Return whether a body is a valid message of the topic."""
    try:
        decode(body, topic.message, 1 << 24)
    except Refusal:
        return False
    return True


SCENARIOS = (
    Scenario(
        "fuzz",
        "5,000 mutated messages on all keys (100,000 with --long)",
        (
            at_least("messages", MESSAGES),
            at_least("requests refused", 1000),
            reported("valid mutants accepted as requests"),
            at_least("publications sent", 1000),
            reported("valid mutants published"),
            none("refusals with an unknown code"),
            none("movements of the arm"),
            none("processes that exited"),
            exactly("outcome of a valid goal afterwards", "succeeded"),
            exactly("processes without garbage collector", len(UNCOLLECTED)),
            none("errors kept in them"),
        ),
        fuzz,
    ),
)
