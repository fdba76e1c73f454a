"""`python -m benchmarks.latency`: from a client's goal to the arm's first command of the new motion, in real time.

All services run as in normal operation. Plan-only goals measure planning and the bus. The same goals played measure the
time until the arm moves, and a stream of 50 goals a second for one hit measures replanning. Corrections at 100 and 250
a second move the target of a swing until shortly before its hit.
"""

import signal
import sys
import time
from collections import Counter
from concurrent.futures import Future, ThreadPoolExecutor

import msgspec
import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.cases import FOREHAND
from benchmarks.machine import save
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.errors import Refusal
from services.common.cell import running_cell
from tools.demo.strikes import FASTER, TIGHT, goal

RATE_HZ = 50
CORRECTIONS_HZ = 100, 250
HIT_AFTER_S = 1.4
STREAM_S = 0.7
SETTLED_S = 1.0
SWING_S, LAST_S = 1.2, 0.08
"""Duration of a corrected swing, and time before its hit at which the last correction is sent, s."""

WANDER = 0.04
"""Largest error, rad, of the first estimate of the target; it shrinks with the square of the time left."""

FIRST = 10
"""Goals after a start for which the planner uses a default lead, since it has measured no planning times yet."""


PendingReply = Future[m.GoalReply | None]


Summary = dict[str, float | dict[str, int]]
"""Percentiles of the milliseconds to the reply and to the first command; number of refused goals by code."""


def tight_goal(rng: np.random.Generator, **fields: object) -> m.Goal:
    """Return a strike with active limits and a slightly random target."""
    wanted = goal(FASTER, limits=TIGHT, **fields)
    positions = np.array(wanted.positions)
    moved = (positions + rng.uniform(-0.01, 0.01, len(positions))).tolist()
    return msgspec.structs.replace(wanted, positions=moved)


class Client:
    """A client that sends goals and measures their latencies, ms."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.reply: list[float] = []
        self.first_command: list[float] = []
        self.asked: dict[str, int] = {}
        self.refused: Counter[str] = Counter()

    def ask(self, wanted: m.Goal) -> m.GoalReply | None:
        """Send a goal; return the reply, or None for a refusal."""
        began, began_ns = time.perf_counter(), time.time_ns()
        try:
            answer = self.bus.ask(topics.GOAL, wanted)
        except Refusal as refusal:
            self.refused[refusal.code] += 1
            return None
        self.reply.append(1e3 * (time.perf_counter() - began))
        self.asked[answer.goal_id] = began_ns
        return answer

    def collect(self) -> None:
        """Collect the controller's times of the first commands of all goals that had one."""
        for goal_id, asked in self.asked.items():
            try:
                stamp = self.bus.ask(topics.RESULT, m.ResultRequest(goal_id=goal_id)).stamps.first_command
            except Refusal:
                continue
            if stamp is not None:
                self.first_command.append((stamp - asked) / 1e6)
        self.asked = {}

    def check(self) -> None:
        """Return if the controller is not in fault.

        Raises:
            SystemExit: with the fault, because every later goal would be refused.
        """
        status = self.bus.ask(topics.STATUS_QUERY, m.Empty())
        if status.fault:
            sys.exit(f"after {len(self.reply)} goals, at {status.time:.3f} s: in fault: {status.fault}")

    def summary(self) -> Summary:
        """Return medians and 99th percentiles of the goals so far."""
        self.check()
        self.collect()
        found: Summary = {"goals": len(self.reply), "refused": dict(self.refused)}
        for name, values in (("reply", self.reply), ("first_command", self.first_command)):
            for part in (50, 99):
                found[f"{name}_p{part}_ms"] = float(np.percentile(values, part)) if values else float("nan")
        return found


def plan_only(bus: Bus, count: int) -> Summary:
    """Measure goals that are only planned, from home."""
    client, rng = Client(bus), np.random.default_rng(1)
    rest = m.Start(positions=list(bus.ask(topics.DESCRIPTION, m.Empty()).home), velocities=[0.0] * 6)
    for _ in range(count):
        client.ask(tight_goal(rng, plan_only=True, start=rest, duration=0.8))
    return client.summary()


def cold(bus: Bus, count: int) -> Summary:
    """Measure the same goals, each with a primitive that was just learned and never planned with."""
    client, rng = Client(bus), np.random.default_rng(1)
    rest = m.Start(positions=list(bus.ask(topics.DESCRIPTION, m.Empty()).home), velocities=[0.0] * 6)
    samples = np.loadtxt(FOREHAND, delimiter=",", skiprows=1)
    learn = m.Learn(name="cold", times=samples[:, 0].tolist(), positions=samples[:, 1:].tolist(), replace=True)
    for _ in range(count):
        bus.ask(topics.LEARN, learn)
        wanted = tight_goal(rng, plan_only=True, start=rest, duration=0.8)
        client.ask(msgspec.structs.replace(wanted, primitive="cold"))
    return client.summary()


def played(bus: Bus, count: int, seed: int) -> Summary:
    """Measure goals that move the arm, each sent while the previous one is under way."""
    client, rng = Client(bus), np.random.default_rng(seed)
    for _ in range(count):
        client.ask(tight_goal(rng, duration=1.0))
        time.sleep(rng.uniform(0.1, 0.3))
    time.sleep(SETTLED_S)
    return client.summary()


def streamed(bus: Bus, strikes: int) -> Summary:
    """Measure fifty goals a second for one hit with a drifting target.

    Each goal is sent on time, whether or not the previous ones were answered.
    """
    client, rng = Client(bus), np.random.default_rng(3)
    with ThreadPoolExecutor(max_workers=RATE_HZ) as askers:
        for _ in range(strikes):
            hit = bus.ask(topics.STATE_QUERY, m.Empty()).time + HIT_AFTER_S
            began = time.monotonic()
            asking = []
            for k in range(round(STREAM_S * RATE_HZ)):
                wanted = tight_goal(rng, arrival_time=hit)
                time.sleep(max(0.0, began + k / RATE_HZ - time.monotonic()))
                asking.append(askers.submit(client.ask, wanted))
            time.sleep(HIT_AFTER_S - STREAM_S + SETTLED_S)
            _settle(client, asking)
    return client.summary()


def corrected(bus: Bus, rate_hz: float, seconds: float) -> Summary:
    """Measure corrections of swings at a rate, each sent on time."""
    client, rng = Client(bus), np.random.default_rng(4)
    with ThreadPoolExecutor(max_workers=round(rate_hz)) as askers:
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            first = client.ask(goal(duration=SWING_S))
            if first is None:
                continue
            asking = _correct(client, first, rate_hz, rng, askers)
            time.sleep(LAST_S + first.total_duration - first.duration)
            _settle(client, asking)
            client.collect()
    return client.summary()


def _correct(
    client: Client, first: m.GoalReply, rate_hz: float, rng: np.random.Generator, askers: ThreadPoolExecutor
) -> list[PendingReply]:
    """Correct one swing from its start to shortly before its hit; the target converges to the goal's."""
    asking = []
    hit_in = first.start_time + first.duration - client.bus.ask(topics.STATE_QUERY, m.Empty()).time
    began, far = time.monotonic(), rng.uniform(-WANDER, WANDER, len(first.positions))
    for k in range(round((hit_in - LAST_S) * rate_hz)):
        left = 1 - k / rate_hz / hit_in
        positions = (np.array(first.positions) + left**2 * far).tolist()
        wanted = msgspec.structs.replace(goal(), positions=positions, revises=first.goal_id)
        time.sleep(max(0.0, began + k / rate_hz - time.monotonic()))
        asking.append(askers.submit(client.ask, wanted))
    return asking


def _settle(client: Client, asking: list[PendingReply]) -> None:
    """Wait for the replies, raise the exception of a thread (`NoAnswer`), and end the benchmark after a fault."""
    for each in asking:
        each.result()
    client.check()


def main(goals: int = 100, strikes: int = 5, seconds: float = 60.0) -> None:
    """Measure this many goals of each kind and corrections for this long; print and save the results."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # leaves the block below, which ends the services
    with running_cell(flags={"clock": "realtime"}, names=["sim", "planner", "controller"], quiet=True) as cell:
        bus = cell.bus
        time.sleep(SETTLED_S)
        found = {
            "plan only, warm": plan_only(bus, goals),
            "plan only, cold": cold(bus, goals),
            "played, first after a start": played(bus, FIRST, seed=1),
            "played": played(bus, goals, seed=2),
            "50 a second": streamed(bus, strikes),
            **{f"{rate} corrections a second": corrected(bus, rate, seconds) for rate in CORRECTIONS_HZ},
        }
        cycle = bus.ask(topics.STATUS_QUERY, m.Empty()).cycle
    report(found, cycle)


def report(found: dict[str, Summary], cycle: m.Cycle) -> None:
    """Print and save the results."""
    names = ("reply_p50_ms", "reply_p99_ms", "first_command_p50_ms", "first_command_p99_ms")
    table = Table("", "goals", *(name.replace("_", " ") for name in names), "refused", title="Latency")
    for name, row in found.items():
        numbers = [f"{row[key]:.1f}" for key in names]
        table.add_row(name, str(row["goals"]), *numbers, str(row["refused"]))
    console = Console(width=120)
    console.print(table)
    console.print(f"controller: {cycle.on_time_ratio:.4f} of {cycle.count} ticks on time meanwhile")
    console.print(f"saved to {save('latency', {**found, 'on_time_ratio': cycle.on_time_ratio}).name}")


if __name__ == "__main__":
    tyro.cli(main)
