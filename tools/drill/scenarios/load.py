"""Overload, oversized requests, and noise: memory remains bounded, and the motion is undisturbed."""

import multiprocessing
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.codec import encode
from tools.drill.harness.cell import ACCEPTED, Cell
from tools.drill.harness.flood import NO_REPLY, Flood
from tools.drill.harness.lab import Lab
from tools.drill.harness.noise import BODY_BYTES, noisy
from tools.drill.harness.on_time_ratio import LOAD_RATIOS, load_ratios, measure_ratio, ratio_since
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, reported, timed

CLIENTS = 4
FLOOD_S = 30.0
IDLE_S = 8.0
MOTION_S = 10.0
"""Duration of the motion under load, s."""
OVERSIZED_EVERY_S = 0.1
OVERSIZED_BYTES = topics.EXECUTE.max_bytes
QUERIES = 10_000


def flood_goals(endpoint: str, robot: str, home: list[float], seconds: float) -> tuple[int, Counter[str]]:
    """Send goals for `seconds`; return their number, and the number of replies by code."""
    goals = [encode(m.Goal(primitive="forehand", positions=[x, *home[1:]], duration=0.6)) for x in (-0.2, 0.2)]
    with Bus(open_session([endpoint]), robot) as bus:
        flood = Flood(bus.session, bus.key(topics.GOAL.key))
        ends = time.monotonic() + seconds
        while time.monotonic() < ends:
            flood.send(goals[flood.sent % 2])
        flood.wait()
    return flood.sent, Counter(flood.codes)


def goals_from_four(lab: Lab) -> Measured:
    """Send goals from four processes as fast as replies come, with at most 16 outstanding in each."""
    with lab.cell(CellConfig(clock="realtime")) as cell:
        cell.listen(topics.STATUS)
        before, memory = measure_ratio(cell, IDLE_S), cell.processes.memory()
        spawn = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(CLIENTS, mp_context=spawn) as pool:
            floods = [
                pool.submit(flood_goals, cell.endpoint, cell.bus.robot, cell.home, FLOOD_S) for _ in range(CLIENTS)
            ]
            time.sleep(3.0)
            during = measure_ratio(cell, FLOOD_S - 5.0)
            results = [flood.result() for flood in floods]
        wait_for(lambda: cell.mode() == "holding", "the arm to rest")
        faults = sum(status.fault is not None for status in cell.drain(topics.STATUS))
        grown = growth(memory, cell)
    sent = sum(count for count, _ in results)
    answers = sum((counted for _, counted in results), Counter())
    return {
        "goals sent": sent,
        "goals accepted": answers[ACCEPTED],
        "requests refused as `busy`": answers["busy"],
        "goals without a reply": sent - answers.total() + answers[NO_REPLY],
        "statuses with a fault": faults,
        **grown,
        **load_ratios(before, during),
    }


def flood_queries(endpoint: str, robot: str, goal_id: str, count: int) -> Counter[str]:
    """Query the result of a goal `count` times without waiting for replies; return the number of replies by code."""
    body = encode(m.ResultRequest(goal_id=goal_id))
    with Bus(open_session([endpoint]), robot) as bus:
        flood = Flood(bus.session, bus.key(topics.RESULT.key), count)
        for _ in range(count):
            flood.send(body)
        flood.wait()
    return Counter(flood.codes)


def load_motion(lab: Lab, load: Callable[[Cell, m.GoalReply], Measured], *more: str) -> Measured:
    """Play a motion of a cell, with `more` services, under load; measure the motion, the processes and the load."""
    with lab.cell(CellConfig(clock="realtime", services=(*ARM, *more))) as cell:
        before, memory = measure_ratio(cell, IDLE_S), cell.processes.memory()
        reply, first = cell.move_aside(MOTION_S), cell.status()
        measured = load(cell, reply)
        during = ratio_since(first, cell)
        result = cell.finish(reply)
        return {
            **measured,
            "outcome of the goal": result.outcome,
            "peak tracking error": result.peak_tracking_error,
            **growth(memory, cell),
            **load_ratios(before, during),
        }


def query_at_once(cell: Cell, reply: m.GoalReply) -> Measured:
    """Send 10,000 `result` queries from four processes, without waiting for replies."""
    arguments = cell.endpoint, cell.bus.robot, reply.goal_id, QUERIES // CLIENTS
    with ProcessPoolExecutor(CLIENTS, mp_context=multiprocessing.get_context("spawn")) as pool:
        floods = [pool.submit(flood_queries, *arguments) for _ in range(CLIENTS)]
        answers = sum((flood.result() for flood in floods), Counter())
    return {
        "queries answered": answers[ACCEPTED],
        "requests refused as `busy`": answers["busy"],
        "queries without a reply": QUERIES - answers[ACCEPTED] - answers["busy"],
    }


def send_oversized_lists(cell: Cell, _: m.GoalReply) -> Measured:
    """Send every request, with each of its fields in turn replaced by an oversized list."""
    sent, codes = 0, Counter[str]()
    for query in topics.QUERIES:
        flood = Flood(cell.bus.session, cell.bus.key(query.key), in_flight=1)
        for body in oversized_lists(query):
            flood.send(body)
            time.sleep(OVERSIZED_EVERY_S)
        flood.wait()
        sent += flood.sent
        codes.update(flood.codes)
    return {"requests sent": sent, "requests not refused as `bad_message`": sent - codes["bad_message"]}


def oversized_lists(query: topics.Query) -> Iterator[bytes]:
    """Yield requests with one known or unknown field: a list of empty lists, as long as accepted, at most 4 MiB."""
    for name in (*query.request.__struct_fields__, "unknown"):
        head = bytes([0x81, 0xA0 + len(name)]) + name.encode()
        count = min(query.max_bytes, OVERSIZED_BYTES) - len(head) - 5
        yield head + b"\xdd" + count.to_bytes(4, "big") + b"\x90" * count


def publish_noise(cell: Cell, _: m.GoalReply) -> Measured:
    """Publish 1 MB/s of random bytes, spread over the keys of all publications."""
    refused = cell.status().cycle.refused
    with noisy(cell) as sent:
        time.sleep(MOTION_S - 2.0)
    counted = cell.status().cycle.refused - refused
    return {"noise sent": sent[0] * BODY_BYTES / 1e6, "noise messages counted by the controller": counted}


def growth(before: Mapping[str, float], cell: Cell) -> Measured:
    """Return the largest growth of a process's memory since `before`, MB."""
    return {
        "largest memory growth of a process": max(
            after - before[name] for name, after in cell.processes.memory().items()
        )
    }


BOUNDED = at_most("largest memory growth of a process", 25.0, "MB")
UNDISTURBED = (timed(exactly("outcome of the goal", "succeeded")), timed(at_most("peak tracking error", 0.02, "rad")))

SCENARIOS = (
    Scenario(
        "goals-flood",
        "goals from four clients for 30 s, as fast as replies come",
        (
            reported("goals sent"),
            reported("goals accepted"),
            at_least("requests refused as `busy`", 1),
            none("goals without a reply"),
            timed(none("statuses with a fault")),
            BOUNDED,
            *LOAD_RATIOS,
        ),
        goals_from_four,
        "realtime",
        "full",
    ),
    Scenario(
        "queries-flood",
        "10,000 `result` queries at once, from four clients, during a motion",
        (
            reported("queries answered"),
            at_least("requests refused as `busy`", 1),
            none("queries without a reply"),
            BOUNDED,
            *UNDISTURBED,
            *LOAD_RATIOS,
        ),
        lambda lab: load_motion(lab, query_at_once),
        "realtime",
        "full",
    ),
    Scenario(
        "oversized-lists",
        "ten requests a second of up to 4 MiB during a motion; each field in turn is a list of millions of empty lists",
        (reported("requests sent"), none("requests not refused as `bad_message`"), BOUNDED, *UNDISTURBED, *LOAD_RATIOS),
        lambda lab: load_motion(lab, send_oversized_lists, "striker"),
        "realtime",
        "full",
    ),
    Scenario(
        "noise",
        "1 MB/s of noise on the keys of all publications during a motion",
        (
            at_least("noise sent", 7.0, "MB"),
            at_least("noise messages counted by the controller", 1),
            BOUNDED,
            *UNDISTURBED,
            *LOAD_RATIOS,
        ),
        lambda lab: load_motion(lab, publish_noise),
        "realtime",
        "full",
    ),
)
