"""More requests than can be served, oversized requests, and noise: queues are bounded, and the motion goes on."""

import multiprocessing
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.codec import encode
from tools.drill.harness.cell import ACCEPTED, Cell
from tools.drill.harness.flood import SILENT, Flood
from tools.drill.harness.lab import Lab
from tools.drill.harness.noise import BODY_BYTES, noisy
from tools.drill.harness.punctuality import RATIOS, answered_since, on_time, ratios
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, reported, timed

CLIENTS = 4
FLOOD_S = 30.0
IDLE_S = 8.0
NOISE_S = 10.0
OVERSIZED_EVERY_S = 0.1
OVERSIZED_BYTES = topics.EXECUTE.max_bytes
QUERIES = 10_000


def flood_goals(endpoint: str, robot: str, home: list[float], seconds: float) -> tuple[int, Counter[str]]:
    """Send goals for `seconds`; return how many, and the replies by code."""
    goals = [encode(m.Goal(primitive="forehand", positions=[x, *home[1:]], duration=0.6)) for x in (-0.2, 0.2)]
    with Bus(open_session([endpoint]), robot) as bus:
        flood = Flood(bus.session, bus.key(topics.GOAL.key))
        ends = time.monotonic() + seconds
        while time.monotonic() < ends:
            flood.send(goals[flood.sent % 2])
        flood.wait()
    return flood.sent, Counter(flood.codes)


def goals_from_four(lab: Lab) -> Measured:
    """Send goals from four processes as fast as replies come, 16 of each unanswered."""
    with lab.cell(CellConfig(clock="realtime")) as cell:
        cell.recover()
        cell.listen(topics.STATUS)
        before, memory = on_time(cell, IDLE_S), cell.processes.memory()
        spawn = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(CLIENTS, mp_context=spawn) as pool:
            floods = [
                pool.submit(flood_goals, cell.endpoint, cell.bus.robot, cell.home, FLOOD_S) for _ in range(CLIENTS)
            ]
            time.sleep(3.0)
            during = on_time(cell, FLOOD_S - 5.0)
            results = [flood.result() for flood in floods]
        wait_for(lambda: cell.mode() == "holding", "the arm to rest")
        faults = sum(status.fault is not None for status in cell.drain(topics.STATUS))
        grown = growth(memory, cell)
    sent = sum(count for count, _ in results)
    answers = sum((counted for _, counted in results), Counter())
    return {
        "goals sent": sent,
        "goals accepted": answers[ACCEPTED],
        "refused as busy": answers["busy"],
        "goals without a reply": sent - answers.total() + answers[SILENT],
        "statuses in fault": faults,
        **grown,
        **ratios(before, during),
    }


def flood_queries(endpoint: str, robot: str, goal_id: str, count: int) -> Counter[str]:
    """Ask `count` times how a goal goes, without waiting for a reply; return the replies by code."""
    body = encode(m.ResultRequest(goal_id=goal_id))
    with Bus(open_session([endpoint]), robot) as bus:
        flood = Flood(bus.session, bus.key(topics.RESULT.key), count)
        for _ in range(count):
            flood.send(body)
        flood.wait()
    return Counter(flood.codes)


def queries_at_once(lab: Lab) -> Measured:
    """Send 10,000 `result` requests from four processes that wait for no reply, during a motion."""
    with lab.cell(CellConfig(clock="realtime")) as cell:
        cell.recover()
        before, memory = on_time(cell, IDLE_S), cell.processes.memory()
        reply = cell.move_aside(10.0)
        first, asked = cell.status(), (cell.endpoint, cell.bus.robot, reply.goal_id, QUERIES // CLIENTS)
        with ProcessPoolExecutor(CLIENTS, mp_context=multiprocessing.get_context("spawn")) as pool:
            floods = [pool.submit(flood_queries, *asked) for _ in range(CLIENTS)]
            answers = sum((flood.result() for flood in floods), Counter())
        during = answered_since(first, cell)
        result = cell.finish(reply)
        grown = growth(memory, cell)
    return {
        "queries": QUERIES,
        "answered": answers[ACCEPTED],
        "refused as busy": answers["busy"],
        "queries without a reply": QUERIES - answers[ACCEPTED] - answers["busy"],
        "the goal": result.outcome,
        "peak tracking error": result.peak_tracking_error,
        **grown,
        **ratios(before, during),
    }


def send_oversized_lists(lab: Lab) -> Measured:
    """Send each request with each of its fields in turn as an oversized list, during a motion."""
    with lab.cell(CellConfig(clock="realtime", names=(*ARM, "striker"))) as cell:
        cell.recover()
        before, memory = on_time(cell, IDLE_S), cell.processes.memory()
        reply = cell.move_aside(NOISE_S)
        first, sent, codes = cell.status(), 0, Counter[str]()
        for query in topics.QUERIES:
            flood = Flood(cell.bus.session, cell.bus.key(query.key), in_flight=1)
            for body in oversized_lists(query):
                flood.send(body)
                time.sleep(OVERSIZED_EVERY_S)
            flood.wait()
            sent += flood.sent
            codes.update(flood.codes)
        during = answered_since(first, cell)
        result = cell.finish(reply)
        grown = growth(memory, cell)
    return {
        "requests sent": sent,
        "requests not refused as `bad_message`": sent - codes["bad_message"],
        "the goal": result.outcome,
        "peak tracking error": result.peak_tracking_error,
        **grown,
        **ratios(before, during),
    }


def oversized_lists(query: topics.Query) -> Iterator[bytes]:
    """Yield requests of one field each, known or unknown: as many empty lists as it may have bytes, at most 4 MiB."""
    for name in (*query.request.__struct_fields__, "unknown"):
        head = bytes([0x81, 0xA0 + len(name)]) + name.encode()
        count = min(query.max_bytes, OVERSIZED_BYTES) - len(head) - 5
        yield head + b"\xdd" + count.to_bytes(4, "big") + b"\x90" * count


def noise(lab: Lab) -> Measured:
    """Publish 1 MB/s of random bytes, spread over the keys of all publications, during a motion."""
    with lab.cell(CellConfig(clock="realtime")) as cell:
        cell.recover()
        before, memory = on_time(cell, IDLE_S), cell.processes.memory()
        refused = cell.status().cycle.refused
        reply = cell.move_aside(NOISE_S)
        with noisy(cell) as sent:
            during = on_time(cell, NOISE_S - 2.0)
        result = cell.finish(reply)
        grown = growth(memory, cell)
        counted = cell.status().cycle.refused - refused
        kilobytes = {name: cell.processes.log(name).stat().st_size / 1e3 for name in ("sim", "controller")}
    return {
        "noise sent": sent[0] * BODY_BYTES / 1e6,
        "refused by the controller": counted,
        "the goal": result.outcome,
        "peak tracking error": result.peak_tracking_error,
        **grown,
        "log written": max(kilobytes.values()),
        **ratios(before, during),
    }


def growth(before: Mapping[str, float], cell: Cell) -> Measured:
    """Return the largest growth of a process's memory since `before`, MB."""
    return {
        "memory of a process grows by": max(after - before[name] for name, after in cell.processes.memory().items())
    }


BOUNDED = at_most("memory of a process grows by", 25.0, "MB")
UNDISTURBED = (timed(exactly("the goal", "succeeded")), timed(at_most("peak tracking error", 0.02, "rad")))

SCENARIOS = (
    Scenario(
        "goals-flood",
        "goals as fast as four clients can send them for 30 s",
        "realtime",
        (
            reported("goals sent"),
            reported("goals accepted"),
            at_least("refused as busy", 1),
            none("goals without a reply"),
            timed(none("statuses in fault")),
            BOUNDED,
            *RATIOS,
        ),
        goals_from_four,
        "full",
    ),
    Scenario(
        "queries-flood",
        "10,000 `result` queries at once, of four clients, in a motion",
        "realtime",
        (
            reported("answered"),
            at_least("refused as busy", 1),
            none("queries without a reply"),
            BOUNDED,
            *UNDISTURBED,
            *RATIOS,
        ),
        queries_at_once,
        "full",
    ),
    Scenario(
        "oversized-lists",
        "requests of up to 4 MiB, each field in turn millions of empty lists, ten a second in a motion",
        "realtime",
        (reported("requests sent"), none("requests not refused as `bad_message`"), BOUNDED, *UNDISTURBED, *RATIOS),
        send_oversized_lists,
        "full",
    ),
    Scenario(
        "noise",
        "1 MB/s of noise on the keys of all publications in a motion",
        "realtime",
        (at_least("noise sent", 7.0, "MB"), at_least("refused by the controller", 1), BOUNDED, *UNDISTURBED, *RATIOS),
        noise,
        "full",
    ),
)
