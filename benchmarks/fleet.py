"""`python -m benchmarks.fleet`: cost of each further robot on one machine and one router, with the clock `paced`."""

import contextlib
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import tyro

from benchmarks.machine import save
from client import Arm, connect
from services.common.cell import RunningCell, running_cell
from services.common.cli import Options, free_endpoint

PRIMITIVE = "forehand"


def families(cells: list[RunningCell]) -> list[psutil.Process]:
    """Return the processes of all services and their child processes."""
    services = [psutil.Process(process.pid) for cell in cells for process in cell.services.running.values()]
    return [one for service in services for one in (service, *service.children(recursive=True))]


def processor_s(processes: list[psutil.Process]) -> float:
    """Return the processor time that processes have used, s."""
    times = [process.cpu_times() for process in processes]
    return sum(one.user + one.system for one in times)


def measure(cells: list[RunningCell], arms: list[Arm], seconds: float) -> dict[str, object]:
    """Play goals on all arms in turn for some seconds."""
    processes = families(cells)
    used, began, starts = processor_s(processes), time.monotonic(), [arm.state().time for arm in arms]
    latencies: list[float] = []
    while time.monotonic() < began + seconds:
        for arm in arms:
            asked = time.perf_counter()
            arm.plan(PRIMITIVE, duration=0.8)
            latencies.append((time.perf_counter() - asked) * 1e3)
        time.sleep(0.1)
    wall = time.monotonic() - began
    rates = [(arm.state().time - start) / wall for arm, start in zip(arms, starts, strict=True)]
    p50, p99 = np.percentile(latencies, [50, 99])
    return {
        "robots": len(arms),
        "cores used": round((processor_s(processes) - used) / wall, 2),
        "memory, MB": round(sum(process.memory_full_info().pss for process in processes) / 1e6),
        "robot time / wall time": [round(rate, 3) for rate in rates],
        "reply to a plan-only goal, ms": {"p50": round(float(p50), 1), "p99": round(float(p99), 1)},
    }


def main(robots: int = 3, seconds: float = 10.0) -> None:
    """Start one robot after the other, measure after each, print and save."""
    endpoint, rows, cells, arms = free_endpoint(), [], [], []
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        for number in range(1, robots + 1):
            options = replace(Options(listen=(endpoint,)), robot=f"arm{number}")
            if number > 1:
                options = replace(options, listen=(), connect=(endpoint,))
            flags = {"clock": "paced", "record": folder / f"{number}.rrd", "unindexed": True}
            cells.append(stack.enter_context(running_cell(options, flags, quiet=True)))
            arms.append(stack.enter_context(connect(endpoint, robot=f"arm{number}")))
            rows.append(measure(cells, arms, seconds))
            print(rows[-1], flush=True)
    save("fleet", rows)


if __name__ == "__main__":
    tyro.cli(main)
