"""Messages that are malformed, old, doubled or out of order, on every key: refused, counted, no sign of life."""

import math
import struct
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

import msgpack
import msgspec
import numpy as np
import zenoh

from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from tools.drill.harness.cell import Cell, wait_for
from tools.drill.harness.lab import Lab
from tools.drill.harness.valid_bodies import Body, good_requests, renewed
from tools.drill.scenario import Measured, Scenario, at_least, exactly, none

NOISE = "noise"
NAN_BYTES = struct.pack("<d", math.nan)
AT_HOME = 1e-6
"""rad; further from home than this, something has moved the arm."""
LOST = 100
"""Ticks without states, more than an arm waits before it brakes."""


def spoiled(value: Any) -> Iterator[object]:
    """Yield a value with one thing in it wrong, for one thing after another: a number, or the length of a vector.

    Of a list's items the first and the last are tried.
    """
    if isinstance(value, float):
        yield from (math.nan, math.inf, -math.inf)
    elif isinstance(value, bytes):
        yield value[:-8]
        yield value[:-8] + NAN_BYTES
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from ({**value, name: wrong} for wrong in spoiled(item))
    elif isinstance(value, list) and value:
        if any(isinstance(item, float) for item in value):
            yield value[:-1]
        for at in {0, len(value) - 1}:
            yield from ([*value[:at], wrong, *value[at + 1 :]] for wrong in spoiled(value[at]))


def spoiled_bodies(body: Body) -> Iterator[object]:
    """Yield a body of another version, with an unknown field, no map at all, and with one thing in it wrong."""
    yield {**body, "version": 2}
    yield {**body, "colour": "red"}
    yield [body]
    yield from spoiled(body)


def bad_requests(lab: Lab) -> Measured:
    """Send every request wrong in every way, look whether anything moved, and whether the right ones are taken."""
    cell = lab.shared()
    refused: Counter[str] = Counter()
    requests = good_requests(cell)
    for key, body in requests:
        refused.update(answer(cell, key, msgpack.packb(wrong) or b"") for wrong in spoiled_bodies(body))
    still = unmoved(cell)
    right = 0
    for key, body in requests:
        cell.reset()
        right += answer(cell, key, msgpack.packb(renewed(cell, key, body)) or b"") != "taken"
    cell.reset()
    return {
        "requests sent": refused.total(),
        "requests taken": refused["taken"],
        "refused, but not as bad_message": refused.total() - refused["taken"] - refused["bad_message"],
        "the same requests unspoiled, but refused": right,
        **still,
    }


def answer(cell: Cell, key: str, body: bytes) -> str:
    """Send a body and return the code of the refusal, `taken`, or `silent`."""
    for reply in cell.bus.session.get(cell.bus.key(key), payload=body, timeout=20.0):
        if reply.ok is not None:
            return "taken"
        if reply.err is not None:
            error = msgpack.unpackb(reply.err.payload.to_bytes())
            return str(error.get("code")) if isinstance(error, dict) else "silent"
    return "silent"


def unmoved(cell: Cell) -> Measured:
    """Let the arm hold its pose for 20 ticks; tell how far it is from home, and who still lives."""
    cell.step(20)
    far = max(abs(x - y) for state in cell.states() for x, y in zip(state.positions, cell.home, strict=True))
    return {"positions away from home": int(far > AT_HOME), "processes ended": len(cell.services.ended())}


def publish(cell: Cell, topic: topics.Publication, bodies: Iterable[bytes]) -> int:
    """Publish bodies as a stranger would, in order and without dropping any; return how many."""
    count = 0
    for body in bodies:
        cell.bus.session.put(cell.bus.key(topic.key), body, congestion_control=zenoh.CongestionControl.BLOCK)
        count += 1
    return count


def bad_publications(message: m.State | m.Command, joints: int) -> list[bytes]:
    """Return a stream's message as no loop may take it: not finite, old, doubled, of wrong length or version."""
    good: Body = msgspec.to_builtins(message)
    if isinstance(message, m.Command):
        good["source"] = NOISE
    vectors = [name for name in ("positions", "velocities", "accelerations") if name in good]
    changes: list[dict[str, Any]] = [{"version": 2}, {"tick": max(0, message.tick - 5)}, {"tick": 1e300}]
    for name in vectors:
        changes += [{name: [wrong] * joints} for wrong in (math.nan, math.inf)] + [{name: [0.0] * (joints - 1)}]
    if isinstance(message, m.State):
        changes.append({})  # Doubled.
    packed = [msgpack.packb({**good, **change}) or b"" for change in changes]
    return [*packed, b"", b"{", b"\xc1" * 100, packed[-1] + b"\x00"]


def bad_states(lab: Lab) -> Measured:
    """Send the controller states that it may not take; look whether it counts them and commands the arm to stay."""
    cell = lab.shared()
    cell.step(50)
    before = cell.status()
    sent = publish(cell, topics.STATE, bad_publications(cell.state(), len(cell.home)))
    wait_for(lambda: cell.status().cycle.refused - before.cycle.refused >= sent, "the controller to count", 5.0)
    counted = cell.status().cycle.refused - before.cycle.refused
    cell.step(20)
    astray = sum(command.positions != cell.home or any(command.velocities) for command in cell.commands())
    far = float(np.abs(np.subtract(cell.state().positions, cell.home)).max())
    cell.reset()  # What was sent stands among the states of this run.
    return {
        "states sent": sent,
        "not counted": sent - counted,
        "commands that do not hold the arm": astray + int(far > AT_HOME),
        **unmoved(cell),
    }


def bad_commands(lab: Lab) -> Measured:
    """While the controller hears no states, send the sim commands that it may not take: it must still brake.

    They are spoiled copies of what would answer the coming tick, and nothing else answers it.
    """
    cell = lab.shared()
    reply = cell.strike()
    cell.step_to(cell.ticks(reply.start_time) + 300)
    good = msgspec.structs.replace(cell.commands()[-1], source=NOISE)
    cell.lose("state", LOST)
    cell.step(1)
    sent, silent = 0, math.nan
    for tick in range(cell.tick, cell.tick + 25):
        due = msgspec.structs.replace(good, tick=tick)
        far = msgspec.structs.replace(good, tick=tick + 1000)
        huge = msgspec.structs.replace(due, accelerations=[1e9] * len(cell.home))
        bad = [*bad_publications(due, len(cell.home)), encode(far), encode(huge)]
        sent += publish(cell, topics.COMMAND, bad)
        for _ in bad:
            cell.state()  # A sim at rest takes one command in between two requests.
        cell.step(1)
        state = cell.state()
        if state.brake:
            silent = state.tick - state.applied_tick - 1
            break
    cell.step(LOST)  # By the next scenario states are heard of again.
    return {
        "commands sent": sent,
        "silent ticks until the arm brakes": silent,
        "processes ended": len(cell.services.ended()),
    }


def wildcards(lab: Lab) -> Measured:
    """Ask with a wildcard everything that changes something."""
    cell = lab.shared()
    wrong = 0
    writing = {topic.key for topic in topics.QUERIES if not topic.reads}
    for key, body in good_requests(cell):
        if key in writing:
            wrong += answer(cell, key[:-1] + "$*", msgpack.packb(body) or b"") != "bad_message"
    return {"requests not refused": wrong, **unmoved(cell)}


UNMOVED = (none("positions away from home"), none("processes ended"))

SCENARIOS = (
    Scenario(
        "bad-requests",
        "NaN, Inf, wrong lengths, versions and fields in every request",
        "stepped",
        (
            at_least("requests sent", 250),
            none("requests taken"),
            none("refused, but not as bad_message"),
            none("the same requests unspoiled, but refused"),
            *UNMOVED,
        ),
        bad_requests,
    ),
    Scenario(
        "bad-states",
        "states not finite, old, doubled, of wrong length or version, and noise",
        "stepped",
        (
            at_least("states sent", 10),
            none("not counted"),
            none("commands that do not hold the arm"),
            *UNMOVED,
        ),
        bad_states,
    ),
    Scenario(
        "bad-commands",
        "the same among commands, while the controller sends none",
        "stepped",
        (at_least("commands sent", 300), exactly("silent ticks until the arm brakes", 20), none("processes ended")),
        bad_commands,
    ),
    Scenario(
        "wildcards",
        "requests that change something, sent to a key with a wildcard",
        "stepped",
        (none("requests not refused"), *UNMOVED),
        wildcards,
    ),
)
