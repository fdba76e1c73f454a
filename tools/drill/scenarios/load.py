"""More requests than can be served, and noise on every key: bounded queues, nothing disturbed."""

import multiprocessing
import os
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

import msgpack
import zenoh

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.codec import ENCODING, encode
from tools.drill.harness.cell import Cell, wait_for
from tools.drill.harness.lab import Lab
from tools.drill.harness.punctuality import RATIOS, answered_since, on_time, ratios
from tools.drill.harness.start import Plan
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, timed, told

CLIENTS = 4
IN_FLIGHT = 16
FLOOD_S = 30.0
IDLE_S = 8.0
NOISE_S = 10.0
NOISE_BYTES = 1000
HOARD_EVERY_S = 0.1
HOARD_BYTES = topics.EXECUTE.max_bytes
QUERIES = 10_000
ANSWER_S = 20.0


class Flood:
    """Sends requests without waiting, at most `in_flight` unanswered, and keeps the codes of the answers."""

    def __init__(self, session: zenoh.Session, key: str, in_flight: int = IN_FLIGHT) -> None:
        self.codes: list[str] = []  # not a Counter: each answer comes in a thread of its own
        self.sent = 0
        self._session = session
        self._key = key
        self._in_flight = in_flight
        self._free = threading.Semaphore(in_flight)

    def send(self, body: bytes) -> None:
        """Send a request once fewer than `in_flight` are unanswered."""
        self._free.acquire()
        self.sent += 1
        handlers = zenoh.handlers.Callback(self._hear, self._free.release)
        self._session.get(self._key, handlers, payload=body, encoding=ENCODING, timeout=ANSWER_S)

    def wait(self) -> None:
        """Wait for the answers still due."""
        for _ in range(self._in_flight):
            self._free.acquire(timeout=ANSWER_S)

    def _hear(self, reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            self.codes.append("taken")
        elif reply.err is not None:
            body = msgpack.unpackb(reply.err.payload.to_bytes())
            self.codes.append(body["code"] if isinstance(body, dict) else "silent")


def flood_goals(endpoint: str, robot: str, home: list[float], seconds: float) -> tuple[int, Counter[str]]:
    """Send goals for `seconds`; return how many, and the answers by code."""
    goals = [encode(m.Goal(primitive="forehand", positions=[x, *home[1:]], duration=0.6)) for x in (-0.2, 0.2)]
    with Bus(open_session([endpoint]), robot) as bus:
        flood = Flood(bus.session, bus.key(topics.GOAL.key))
        ends = time.monotonic() + seconds
        while time.monotonic() < ends:
            flood.send(goals[flood.sent % 2])
        flood.wait()
    return flood.sent, Counter(flood.codes)


def goals_from_four(lab: Lab) -> Measured:
    """Four processes send goals as fast as answers come, 16 of each unanswered."""
    with lab.cell(Plan(clock="realtime")) as cell:
        cell.recover()
        cell.listen(topics.STATUS)
        before, memory = on_time(cell, IDLE_S), cell.memory()
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
        "goals taken": answers["taken"],
        "told busy": answers["busy"],
        "goals without an answer": sent - answers.total() + answers["silent"],
        "statuses in fault": faults,
        **grown,
        **ratios(before, during),
    }


def flood_queries(endpoint: str, robot: str, goal_id: str, count: int) -> Counter[str]:
    """Ask `count` times how a goal goes, without waiting for an answer; return the answers by code."""
    body = encode(m.ResultRequest(goal_id=goal_id))
    with Bus(open_session([endpoint]), robot) as bus:
        flood = Flood(bus.session, bus.key(topics.RESULT.key), count)
        for _ in range(count):
            flood.send(body)
        flood.wait()
    return Counter(flood.codes)


def queries_at_once(lab: Lab) -> Measured:
    """10,000 `result` requests from four processes that wait for no answer, during a motion."""
    with lab.cell(Plan(clock="realtime")) as cell:
        cell.recover()
        before, memory = on_time(cell, IDLE_S), cell.memory()
        reply = cell.goal(positions=[0.5, *cell.home[1:]], duration=10.0)
        first, asked = cell.status(), (cell.endpoint, cell.bus.robot, reply.goal_id, QUERIES // CLIENTS)
        with ProcessPoolExecutor(CLIENTS, mp_context=multiprocessing.get_context("spawn")) as pool:
            floods = [pool.submit(flood_queries, *asked) for _ in range(CLIENTS)]
            answers = sum((flood.result() for flood in floods), Counter())
        during = answered_since(first, cell)
        result = cell.finish(reply)
        grown = growth(memory, cell)
    return {
        "queries": QUERIES,
        "answered": answers["taken"],
        "told busy": answers["busy"],
        "queries without an answer": QUERIES - answers["taken"] - answers["busy"],
        "the goal": result.outcome,
        "peak tracking error": result.peak_tracking_error,
        **grown,
        **ratios(before, during),
    }


def hoards_in_a_motion(lab: Lab) -> Measured:
    """Each request in turn, with each of its fields made a hoard."""
    with lab.cell(Plan(clock="realtime")) as cell:
        cell.recover()
        before, memory = on_time(cell, IDLE_S), cell.memory()
        reply = cell.goal(positions=[0.5, *cell.home[1:]], duration=NOISE_S)
        first, sent, codes = cell.status(), 0, Counter[str]()
        for query in topics.QUERIES:
            flood = Flood(cell.bus.session, cell.bus.key(query.key), in_flight=1)
            for body in hoards(query):
                flood.send(body)
                time.sleep(HOARD_EVERY_S)
            flood.wait()
            sent += flood.sent
            codes.update(flood.codes)
        during = answered_since(first, cell)
        result = cell.finish(reply)
        grown = growth(memory, cell)
    return {
        "hoards sent": sent,
        "hoards not refused as `bad_message`": sent - codes["bad_message"],
        "the goal": result.outcome,
        "peak tracking error": result.peak_tracking_error,
        **grown,
        **ratios(before, during),
    }


def hoards(query: topics.Query) -> Iterator[bytes]:
    """Make requests of one field each, its own or a strange one: as many empty lists as it may have bytes, or 4 MiB."""
    for name in (*query.request.__struct_fields__, "strange"):
        head = bytes([0x81, 0xA0 + len(name)]) + name.encode()
        count = min(query.max_bytes, HOARD_BYTES) - len(head) - 5
        yield head + b"\xdd" + count.to_bytes(4, "big") + b"\x90" * count


def noise(lab: Lab) -> Measured:
    """1 MB/s of random bytes, spread over every key that anyone publishes on, during a motion."""
    with lab.cell(Plan(clock="realtime")) as cell:
        cell.recover()
        before, memory = on_time(cell, IDLE_S), cell.memory()
        refused = cell.status().cycle.refused
        reply = cell.goal(positions=[0.5, *cell.home[1:]], duration=NOISE_S)
        with noisy(cell) as sent:
            during = on_time(cell, NOISE_S - 2.0)
        result = cell.finish(reply)
        grown = growth(memory, cell)
        counted = cell.status().cycle.refused - refused
        kilobytes = {name: (cell.folder / f"{name}.log").stat().st_size / 1e3 for name in ("sim", "controller")}
    return {
        "noise sent": sent[0] * NOISE_BYTES / 1e6,
        "refused by the controller": counted,
        "the goal": result.outcome,
        "peak tracking error": result.peak_tracking_error,
        **grown,
        "log written": max(kilobytes.values()),
        **ratios(before, during),
    }


@contextmanager
def noisy(cell: Cell, where: Sequence[topics.Publication] = topics.PUBLICATIONS) -> Iterator[list[int]]:
    """Publish 1 MB/s of noise until the block ends; the list holds how many messages were sent."""
    sent, stopping = [0], threading.Event()

    def publish(session: zenoh.Session, keys: list[str]) -> None:
        began = time.monotonic()
        while not stopping.wait(0.005):
            while sent[0] * NOISE_BYTES < 1e6 * (time.monotonic() - began):
                session.put(keys[sent[0] % len(keys)], os.urandom(NOISE_BYTES))
                sent[0] += 1

    keys = [cell.bus.key(topic.key) for topic in where]
    with open_session([cell.endpoint]) as session:
        thread = threading.Thread(target=publish, args=(session, keys))
        thread.start()
        try:
            yield sent
        finally:
            stopping.set()
            thread.join()


def growth(before: Mapping[str, float], cell: Cell) -> Measured:
    """Return by how much the memory of the process that has grown most since `before` has grown, MB."""
    return {"memory of a process grows by": max(after - before[name] for name, after in cell.memory().items())}


BOUNDED = at_most("memory of a process grows by", 25.0, "MB")
UNDISTURBED = (timed(exactly("the goal", "succeeded")), timed(at_most("peak tracking error", 0.02, "rad")))

SCENARIOS = (
    Scenario(
        "goals-flood",
        "goals as fast as four clients can send them for 30 s",
        "realtime",
        (
            told("goals sent"),
            told("goals taken"),
            at_least("told busy", 1),
            none("goals without an answer"),
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
            told("answered"),
            at_least("told busy", 1),
            none("queries without an answer"),
            BOUNDED,
            *UNDISTURBED,
            *RATIOS,
        ),
        queries_at_once,
        "full",
    ),
    Scenario(
        "hoards",
        "requests of up to 4 MiB, each field in turn millions of empty lists, ten a second in a motion",
        "realtime",
        (told("hoards sent"), none("hoards not refused as `bad_message`"), BOUNDED, *UNDISTURBED, *RATIOS),
        hoards_in_a_motion,
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
