"""`python -m benchmarks.starts`: reliability and duration of repeated starts, with busy processes in parallel.

Each start is a separate `python -m services` with a new library. It must report that it is ready, play a goal to its
end, and end on Ctrl-C with status 0.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import tyro
from rich.progress import track

from benchmarks.machine import save
from client import NoAnswer, NoRouter, Refusal, connect
from protocol.messages import Clock
from services.common.cli import free_endpoint

READY = b"volley is ready"
PATIENCE_S = 120.0
POLL_S = 0.05


@contextlib.contextmanager
def busy(count: int) -> Iterator[None]:
    """Run `count` processes that compute forever."""
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


def start(scratch: Path, log: Path, clock: Clock) -> float:
    """Start, play a goal, end; return the seconds until all services were ready.

    Raises:
        RuntimeError: it was not ready in time, did not play the goal, or did not end; the sentence says which.
    """
    endpoint, began = free_endpoint(), time.monotonic()
    line = [sys.executable, "-m", "services", "--listen", endpoint, "--clock", clock]
    line += ["--library", str(scratch / "library"), "--record", str(scratch / "trace.rrd")]
    with log.open("wb") as output:
        process = subprocess.Popen(line, stdout=output, stderr=output)
    try:
        while READY not in log.read_bytes():
            if process.poll() is not None or time.monotonic() > began + PATIENCE_S:
                raise RuntimeError(f"was not ready after {time.monotonic() - began:.1f} s")
            time.sleep(POLL_S)
        took = time.monotonic() - began
        play(endpoint)
    finally:
        process.send_signal(signal.SIGINT)
        status = process.wait(PATIENCE_S)
    if status:
        raise RuntimeError(f"ended with status {status}")
    return took


def play(endpoint: str) -> None:
    """Play a forehand to its end.

    Raises:
        RuntimeError: it was refused, or did not succeed.
    """
    try:
        with connect(endpoint) as arm:
            result = arm.goal("forehand").wait(PATIENCE_S)
    except (Refusal, NoAnswer, NoRouter, TimeoutError) as error:
        raise RuntimeError(f"did not play a goal: {error}") from None
    if result.outcome != "succeeded":
        raise RuntimeError(f"the goal was {result.outcome}: {result.reason}")


def main(starts: int = 50, beside: int = 4, clock: Clock = "paced", logs: Path | None = None) -> None:
    """Start this often with `beside` busy processes; print and save the times, and keep the logs of failures."""
    seconds, failures = [], []
    with busy(beside):
        for number in track(range(starts), "starts"):
            with TemporaryDirectory() as scratch:
                log = Path(scratch) / "log"
                try:
                    seconds.append(start(Path(scratch), log, clock))
                except RuntimeError as failure:
                    failures.append(f"start {number} {failure}")
                    if logs is not None:
                        logs.mkdir(parents=True, exist_ok=True)
                        (logs / f"start-{number}.log").write_bytes(log.read_bytes())
    found = {"starts": starts, "busy processes": beside, "clock": clock, "cores": os.cpu_count(), "failures": failures}
    found |= {f"p{part} s": float(np.percentile(seconds, part)) for part in (0, 50, 90, 100) if seconds}
    print(found)
    print(f"saved to {save('starts', found).name}")


if __name__ == "__main__":
    tyro.cli(main)
