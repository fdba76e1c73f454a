"""`python -m benchmarks.loop`: speed of the stepped clock, punctuality of the real one, cost of the recorder.

Stepped: sim, planner and controller in lock-step. Real time: all services, with occasional strikes. The recorder's
share of a core is its CPU time over wall time; its losses are the ticks that are missing in the trace.
"""

import os
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.machine import save
from protocol import messages as m
from protocol import topics
from services.common.cell import running_cell
from tools.demo.strikes import goal
from tools.trace_reader import read_trace

BLOCKS = 5
STEPS = 2000
SETTLED_S = 2.0


def stepped() -> dict[str, float]:
    """Return the ticks a second of lock-step over the robot's rate, by block."""
    with running_cell(flags={"clock": "stepped"}, names=["sim", "planner", "controller"], quiet=True) as cell:
        time.sleep(SETTLED_S)
        cell.bus.ask(topics.SIM_RESET, m.Reset())
        ratios = []
        for _ in range(BLOCKS):
            began = time.perf_counter()
            cell.bus.ask(topics.SIM_STEP, m.Step(ticks=STEPS))
            ratios.append(STEPS / 1000 / (time.perf_counter() - began))
    return {"times real time, median": float(np.median(ratios)), "least": min(ratios), "most": max(ratios)}


def real_time(scratch: str, seconds: float) -> dict[str, float]:
    """Return on-time ratio and response times of the loop, CPU share and losses of the recorder."""
    file = Path(scratch) / "loop.rrd"
    with running_cell(flags={"clock": "realtime", "record": file}, quiet=True) as cell:
        time.sleep(SETTLED_S)
        cell.bus.ask(topics.SIM_RESET, m.Reset())
        recorder = cell.services.running["recorder"].pid
        began, used = time.perf_counter(), cpu_seconds(recorder)
        while time.perf_counter() - began < seconds:
            cell.bus.ask(topics.GOAL, goal())
            time.sleep(2.5)
        share = (cpu_seconds(recorder) - used) / (time.perf_counter() - began)
        status = cell.bus.ask(topics.STATUS_QUERY, m.Empty())
    cycle = status.cycle
    return {
        "on time, %": 100 * cycle.on_time_ratio,
        "ticks": cycle.count,
        "ticks that the controller passed over": round(status.time * 1000) + 1 - cycle.count,
        "answer p50, µs": cycle.late_us.p50,
        "answer p99, µs": cycle.late_us.p99,
        "recorder, % of a core": 100 * share,
        **lost(file),
    }


def lost(file: Path) -> dict[str, float]:
    """Return the ticks of each stream that are missing in the trace; a command that was never sent is no loss."""
    trace = read_trace(file)
    missing = {}
    for stream, curve in (("state", "measured"), ("command", "reference")):
        ticks = trace.column(f"/joints/joint_1/position/{curve}").ticks()
        missing[f"ticks without {stream}"] = int(ticks[-1] - ticks[0] + 1 - len(ticks))
    return missing


def cpu_seconds(pid: int) -> float:
    """Return the user and system time, s, of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main(seconds: float = 30.0) -> None:
    """Measure the loop, in real time for some seconds; print and save the results."""
    with TemporaryDirectory() as scratch:
        results = {"stepped clock": stepped(), "real time": real_time(scratch, seconds)}
    console = Console()
    for title, values in results.items():
        shown = Table("", "", title=title, show_header=False)
        for name, value in values.items():
            shown.add_row(name, f"{value:.4g}")
        console.print(shown)
    console.print(f"saved in {save('loop', results)}", highlight=False)


if __name__ == "__main__":
    tyro.cli(main)
