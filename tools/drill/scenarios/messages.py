"""Malformed, old, duplicated and reordered messages on every key: each is refused, counted, and resets no timeout."""

import math
import struct
from collections import Counter
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from tools.drill.harness.cell import ACCEPTED
from tools.drill.harness.lab import Lab
from tools.drill.harness.mutations import pack
from tools.drill.harness.raw import AT_HOME, UNMOVED, answer, check_unmoved, publish
from tools.drill.harness.valid_bodies import Body, renewed, valid_requests
from tools.drill.harness.waiting import eventually
from tools.drill.scenario import Measured, Scenario, at_least, exactly, none

NOISE = "noise"
NAN_BYTES = struct.pack("<d", math.nan)
BATCH = topics.QUEUE_LENGTH // 2
"""Number of publications that are sent at once: of a longer burst a stream keeps the newest."""
OLD_TICKS = 25
"""Age of an old command or state; a command that is not older than the silence timeout, 20 ticks, would be accepted."""
LOST_TICKS = 100
"""Number of ticks without states, more than the arm's silence timeout."""


def invalid_values(value: Any) -> Iterator[object]:
    """Yield copies of a value, each with one error: a number that is not finite, or a wrong length of a vector.

    In a list only the first and the last item are changed.
    """
    if isinstance(value, float):
        yield from (math.nan, math.inf, -math.inf)
    elif isinstance(value, bytes):
        yield value[:-8]
        yield value[:-8] + NAN_BYTES
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from ({**value, name: wrong} for wrong in invalid_values(item))
    elif isinstance(value, list) and value:
        if any(isinstance(item, float) for item in value):
            yield value[:-1]
        for at in {0, len(value) - 1}:
            yield from ([*value[:at], wrong, *value[at + 1 :]] for wrong in invalid_values(value[at]))


def invalid_bodies(body: Body) -> Iterator[object]:
    """Yield a body of another version, one with an unknown field, one that is not a map, and those with an error."""
    yield {**body, "version": 2}
    yield {**body, "colour": "red"}
    yield [body]
    yield from invalid_values(body)


def bad_requests(lab: Lab) -> Measured:
    """Send invalid variants of every request; check that the arm has not moved and that valid requests are accepted."""
    cell = lab.shared_cell()
    refused: Counter[str] = Counter()
    requests = valid_requests(cell)
    for key, body in requests:
        refused.update(answer(cell, key, pack(wrong)) for wrong in invalid_bodies(body))
    sent, still = refused.total(), check_unmoved(cell)
    correct_refused = 0
    for key, body in requests:
        cell.reset()
        correct_refused += answer(cell, key, pack(renewed(cell, key, body))) != ACCEPTED
    cell.reset()
    return {
        "requests sent": sent,
        "requests accepted": refused[ACCEPTED],
        "requests refused with another code than `bad_message`": sent - refused[ACCEPTED] - refused["bad_message"],
        "valid requests refused": correct_refused,
        **still,
    }


def bad_publications(message: m.State | m.Command, joints: int) -> list[bytes]:
    """Return invalid variants of a message: not finite, old, duplicated, of wrong length or version, truncated."""
    good: Body = msgspec.to_builtins(message)
    if isinstance(message, m.Command):
        good["source"] = NOISE
    vectors = [name for name in ("positions", "velocities", "accelerations") if name in good]
    changes: list[dict[str, Any]] = [{"version": 2}, {"tick": max(0, message.tick - OLD_TICKS)}, {"tick": 1e300}]
    for name in vectors:
        changes += [{name: [wrong] * joints} for wrong in (math.nan, math.inf)] + [{name: [0.0] * (joints - 1)}]
    if isinstance(message, m.State):
        changes.append({})  # duplicated
    packed = [pack({**good, **change}) for change in changes]
    return [*packed, b"", b"{", b"\xc1" * 100, packed[-1] + b"\x00"]


def batches(bodies: list[bytes]) -> Iterator[list[bytes]]:
    """Yield the bodies in groups of at most `BATCH`."""
    for begin in range(0, len(bodies), BATCH):
        yield bodies[begin : begin + BATCH]


def bad_states(lab: Lab) -> Measured:
    """Send invalid states to the controller; check that it counts them and holds the arm."""
    cell = lab.shared_cell()
    cell.step(50)
    before = cell.status().cycle.refused
    sent = 0
    for batch in batches(bad_publications(cell.state(), len(cell.home))):
        sent += publish(cell, topics.STATE, batch)
        eventually(lambda due=before + sent: cell.status().cycle.refused >= due)
    counted = cell.status().cycle.refused - before
    cell.step(20)
    moving = sum(command.positions != cell.home or any(command.velocities) for command in cell.commands())
    far = float(np.abs(np.subtract(cell.state().positions, cell.home)).max())
    cell.reset()  # the invalid states are among those of this run
    return {
        "states sent": sent,
        "invalid states not counted": sent - counted,
        "commands that do not hold the arm": moving + int(far > AT_HOME),
        **check_unmoved(cell),
    }


def bad_commands(lab: Lab) -> Measured:
    """Send invalid commands to the sim while the controller receives no states; the sim must brake.

    They are variants of the command that would answer the next tick, which no valid command answers.
    """
    cell = lab.shared_cell()
    reply = cell.strike()
    cell.step_to(cell.ticks(reply.start_time) + 300)
    good = msgspec.structs.replace(cell.commands()[-1], source=NOISE)
    cell.drop_messages("state", LOST_TICKS)
    cell.step(1)
    sent, silent = 0, math.nan
    for tick in range(cell.tick, cell.tick + 25):
        due = msgspec.structs.replace(good, tick=tick)
        far = msgspec.structs.replace(good, tick=tick + 1000)
        huge = msgspec.structs.replace(due, accelerations=[1e9] * len(cell.home))
        bad = [*bad_publications(due, len(cell.home)), encode(far), encode(huge)]
        for batch in batches(bad):
            sent += publish(cell, topics.COMMAND, batch)
            for _ in batch:
                cell.state()  # between two requests the waiting sim reads one command
        cell.step(1)
        state = cell.state()
        if state.brake:
            silent = state.tick - state.applied_tick - 1
            break
    cell.step(LOST_TICKS)  # until the controller receives states again
    return {
        "commands sent": sent,
        "ticks without a command until the arm brakes": silent,
        "processes that exited": cell.processes.ended(),
    }


def wildcards(lab: Lab) -> Measured:
    """Send every request that changes something to a key with a wildcard."""
    cell = lab.shared_cell()
    wrong = 0
    writing = {topic.key for topic in topics.QUERIES if not topic.reads}
    for key, body in valid_requests(cell):
        if key in writing:
            wrong += answer(cell, key[:-1] + "$*", pack(body)) != "bad_message"
    return {"requests not refused": wrong, **check_unmoved(cell)}


SCENARIOS = (
    Scenario(
        "bad-requests",
        "NaN, Inf, wrong lengths, versions and fields in every request",
        (
            at_least("requests sent", 250),
            none("requests accepted"),
            none("requests refused with another code than `bad_message`"),
            none("valid requests refused"),
            *UNMOVED,
        ),
        bad_requests,
    ),
    Scenario(
        "bad-states",
        "non-finite, old and duplicated states, wrong lengths and versions, and noise",
        (
            at_least("states sent", 10),
            none("invalid states not counted"),
            none("commands that do not hold the arm"),
            *UNMOVED,
        ),
        bad_states,
    ),
    Scenario(
        "bad-commands",
        "non-finite and old commands, wrong lengths and versions, and noise, while the controller sends none",
        (
            at_least("commands sent", 300),
            exactly("ticks without a command until the arm brakes", 20),
            none("processes that exited"),
        ),
        bad_commands,
    ),
    Scenario(
        "wildcards",
        "requests that change something, sent to a key with a wildcard",
        (none("requests not refused"), *UNMOVED),
        wildcards,
    ),
)
