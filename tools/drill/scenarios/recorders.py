"""A recorder that is killed, stopped or without disk space: the loop is undisturbed, and the trace is readable."""

import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from tools.drill.harness.cell import Cell
from tools.drill.harness.lab import Lab
from tools.drill.harness.on_time_ratio import LEAST_PERCENT, measure_ratio, ratio_since
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, timed
from tools.trace_reader import read_chunks

WINDOW_S = 8.0
SPARE_BYTES = 100_000


def break_recorder(lab: Lab, fault: Callable[[Cell, Path], None], continues: bool = False) -> Measured:
    """Compare the on-time ratio before and after a fault during a motion, and read the trace.

    The trace must reach to the fault, or to the end of the motion if the recorder `continues`.
    """
    trace = lab.folder / f"{time.monotonic_ns()}.rrd"
    config = CellConfig(clock="realtime", services=(*ARM, "recorder"), flags={"record": trace})
    with lab.cell(config) as cell:
        time.sleep(1.0)
        before = measure_ratio(cell, WINDOW_S)
        reply = cell.move_aside(12.0)
        time.sleep(2.0)
        first = cell.status()
        fault(cell, trace)
        expected = cell.state().tick
        time.sleep(WINDOW_S)
        after = ratio_since(first, cell)
        cell.processes.signal("recorder", signal.SIGCONT)
        result = cell.finish(reply)
        if continues:
            expected = cell.state().tick
    readable = optimized(trace)
    ticks = ticks_of(readable) if readable else []
    return {
        "change of the on-time ratio": 100 * (after - before),
        "on-time ratio before": 100 * before,
        "outcome of the goal": result.outcome,
        "trace readable": "yes" if ticks else "no",
        "trace missing at the end": max(0, expected - max(ticks, default=0)) * cell.config.tick,
        "ticks missing within the trace": missing_between(ticks),
    }


def kill(cell: Cell, _: Path) -> None:
    """Kill the recorder."""
    cell.processes.signal("recorder", signal.SIGKILL)


def stop(cell: Cell, _: Path) -> None:
    """Stop the recorder, which is continued later in the motion."""
    cell.processes.signal("recorder", signal.SIGSTOP)


def fill_disk(cell: Cell, trace: Path) -> None:
    """Limit the size of the trace, so that every further write fails as on a full disk."""
    pid = cell.processes.pids()["recorder"]
    limit = trace.stat().st_size + SPARE_BYTES
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (limit, limit))
    wait_for(lambda: trace.stat().st_size >= limit, "the trace to be full")


def optimized(trace: Path) -> Path | None:
    """Repair a trace with Rerun's tool and return the new file, or None if the tool fails."""
    repaired = trace.with_suffix(".repaired.rrd")
    tool = Path(sys.executable).with_name("rerun")
    done = subprocess.run([tool, "rrd", "optimize", trace, "-o", repaired], check=False, capture_output=True)
    return repaired if done.returncode == 0 and repaired.exists() else None


def ticks_of(trace: Path) -> list[int]:
    """Return the ticks of joint_1's measured positions in a trace, unordered."""
    ticks: list[int] = []
    for chunk in read_chunks(trace):
        if str(chunk.entity_path).endswith("joint_1/position/measured"):
            batch = chunk.to_record_batch()
            if "tick" in batch.schema.names:
                ticks += batch.column("tick").to_pylist()
    return ticks


def missing_between(ticks: list[int]) -> int:
    """Count the ticks that are missing between the first and the last."""
    return max(ticks) - min(ticks) + 1 - len(set(ticks)) if ticks else 0


BOUNDS = (
    timed(at_least("on-time ratio before", LEAST_PERCENT, "%")),
    timed(at_least("change of the on-time ratio", -2.0, "%")),
    timed(exactly("outcome of the goal", "succeeded")),
    exactly("trace readable", "yes"),
)
LOST = (at_most("trace missing at the end", 1.0, "s"), none("ticks missing within the trace"))

SCENARIOS = (
    Scenario(
        "recorder-killed",
        "recorder killed during a motion",
        (*BOUNDS, *LOST),
        lambda lab: break_recorder(lab, kill),
        "realtime",
        "full",
    ),
    Scenario(
        "recorder-stopped",
        "recorder stopped during a motion, continued at its end",
        (*BOUNDS, *LOST),
        lambda lab: break_recorder(lab, stop, continues=True),
        "realtime",
        "full",
    ),
    Scenario(
        "disk-full",
        "the recorder's writes fail during a motion (its file may not grow)",
        (*BOUNDS, *LOST),
        lambda lab: break_recorder(lab, fill_disk),
        "realtime",
        "full",
    ),
)
