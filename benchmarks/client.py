"""`python -m benchmarks.client`: overhead of the client library over raw Zenoh, for single requests.

A separate process replies to `status` with the golden message of the contract's tests. The same request is sent in turn
by `session.get` without decoding the reply, by the blocking arm of the library, and by its asynchronous arm.
"""

import asyncio
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.machine import save
from client import Arm, AsyncArm, connect, connect_async
from protocol.bus.bus import Bus
from protocol.bus.queues import Inbox
from protocol.bus.sessions import open_session
from protocol.topics import STATUS_QUERY
from services.common.cli import free_endpoint
from tests.golden.examples import EXAMPLES

WAYS = "raw Zenoh", "Arm", "AsyncArm"


def main(requests: int = 3000, serve: str | None = None) -> None:
    """Measure the overhead of the client library over raw Zenoh; print and save it.

    Args:
        requests: Number of requests by each way.
        serve: Reply at this endpoint instead, until standard input ends.
    """
    if serve:
        reply_to_status(serve)
        return
    endpoint = free_endpoint()
    line = [sys.executable, "-m", "benchmarks.client", "--serve", endpoint]
    with subprocess.Popen(line, stdin=subprocess.PIPE) as server, connect(endpoint) as arm:
        try:
            while not arm.bus.is_alive("controller"):
                time.sleep(0.05)
            times = asyncio.run(measure(arm, endpoint, requests))
        finally:
            server.kill()
    report(times)


def reply_to_status(endpoint: str) -> None:
    """Run a router and reply to `status`."""
    inbox = Inbox()
    with Bus(open_session(listen=[endpoint])) as bus:
        bus.serve(STATUS_QUERY, inbox)
        bus.announce("controller")
        while (query := inbox.take(None)) is not None:
            query.reply(EXAMPLES["Status"])


async def measure(arm: Arm, endpoint: str, count: int) -> np.ndarray:
    """Return the times, s, (count, 3): the ways take turns, so that other load affects all of them alike."""
    async with connect_async(endpoint) as twin:
        times = np.empty((count, len(WAYS)))
        for row in times:
            row[:] = timed(lambda: raw(arm)), timed(arm.status), await awaited(twin)
    return times[count // 10 :]


def raw(arm: Arm) -> bytes:
    """Send a request by Zenoh's own API."""
    for reply in arm.bus.session.get(arm.bus.key("status"), payload=b"\x80", timeout=5.0):
        assert reply.ok is not None
        return reply.ok.payload.to_bytes()
    raise AssertionError("no reply")


def timed(ask: Callable[[], object]) -> float:
    """Return the duration of a request, s."""
    began = time.perf_counter()
    ask()
    return time.perf_counter() - began


async def awaited(arm: AsyncArm) -> float:
    """Return the duration of an awaited request, s."""
    began = time.perf_counter()
    await arm.status()
    return time.perf_counter() - began


def report(times: np.ndarray) -> None:
    """Print the table and save it."""
    table = Table("status", "p50 ms", "p99 ms", "over raw, p50 ms", "÷ raw", title="One request")
    results = {}
    base = float(np.median(times[:, 0]))
    for name, column in zip(WAYS, times.T, strict=True):
        median, tail = float(np.median(column)), float(np.percentile(column, 99))
        table.add_row(
            name, f"{1e3 * median:.3f}", f"{1e3 * tail:.3f}", f"{1e3 * (median - base):.3f}", f"{median / base:.2f}"
        )
        results[name] = {"p50_ms": 1e3 * median, "p99_ms": 1e3 * tail, "ratio": median / base}
    Console().print(table)
    save("client", results)


if __name__ == "__main__":
    tyro.cli(main)
