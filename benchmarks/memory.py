"""`python -m benchmarks.memory`: resident memory over many goals, in this process and in a planner on the bus.

With `--robots ROBOT.toml …` instead: the memory of each service of a robot.
"""

import gc
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.progress import track

from benchmarks.cases import draw, forehand
from benchmarks.latency import tight_goal
from benchmarks.machine import save
from motion.errors import MotionError
from motion.plan import plan
from motion.request import Waypoint
from protocol import topics
from services.common.cell import running_cell
from services.common.cli import Options, free_endpoint

SERVICES = ["sim", "planner", "controller", "recorder"]

MEMORY = {"share": ("smaps_rollup", "Pss"), "resident": ("status", "VmRSS"), "peak": ("status", "VmHWM")}
"""File and key of each kind of memory. share: pages shared by several processes are divided between them (PSS).
resident: without that division. peak: largest so far."""

MARKS = 20
"""Number of readings of the memory."""


def read_kb(process: int | str, file: str = "status", key: str = "VmRSS") -> int:
    """Return a number of kB in a file of /proc/PROCESS, by default the resident memory."""
    lines = Path(f"/proc/{process}/{file}").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{key}:"))


def here(goals: int, seed: int) -> dict[str, object]:
    """Plan six-joint goals, warm, a tenth of them with waypoints at random times."""
    primitive, rng = forehand(), np.random.default_rng(seed)
    requests = [case.request for case in draw(primitive, 20, seed)]
    warm, refused, kilobytes = None, 0, []
    for k in track(range(goals), "planned here"):
        request = requests[k % len(requests)]
        duration = request.duration * rng.uniform(1.0, 1.05)
        time = duration * rng.uniform(0.3, 0.7)
        through = primitive.positions(np.array([time / duration]))[0]
        waypoints = () if k % 10 else (Waypoint(time, through, np.full(request.joint_count, np.nan)),)
        try:
            made = plan(primitive, replace(request, duration=duration, waypoints=waypoints), warm=warm)
            made.samples()
            warm = made.warm
        except MotionError:
            refused += 1
        if k % max(1, goals // MARKS) == 0:
            gc.collect()
            kilobytes.append(read_kb("self"))
    kilobytes.append(read_kb("self"))
    return {"goals": goals, "refused": refused, "resident_kB": kilobytes}


def on_the_wire(goals: int, seed: int) -> dict[str, object]:
    """Send plan-only goals to a planner without an arm, a tenth of them with the trajectory in the reply."""
    rng, kilobytes = np.random.default_rng(seed), []
    with running_cell(names=["planner"], quiet=True) as cell:
        for k in track(range(goals), "asked of a planner"):
            cell.bus.ask(topics.GOAL, tight_goal(rng, plan_only=True, duration=0.8, include_trajectory=k % 10 == 0))
            if k % max(1, goals // MARKS) == 0:
                kilobytes.append(read_kb(cell.services.running["planner"].pid))
    return {"goals": goals, "resident_kB": kilobytes}


def of_services(robot: Path, seconds: float) -> dict[str, dict[str, int]]:
    """Return the memory of a robot's services while its arm rests and a trace is written, MB."""
    found: dict[str, dict[str, int]] = {}
    with tempfile.TemporaryDirectory() as folder:
        flags = {"clock": "paced", "record": str(Path(folder) / "trace.rrd")}
        options = Options(robot_config=robot, listen=(free_endpoint(),))
        with running_cell(options, flags, SERVICES, quiet=True) as cell:
            time.sleep(seconds)
            for name, process in cell.services.running.items():
                found[name] = {what: read_kb(process.pid, *where) // 1000 for what, where in MEMORY.items()}
    return {**found, "all": {what: sum(row[what] for row in found.values()) for what in MEMORY}}


def main(
    goals: int = 100_000, asked: int = 100_000, seed: int = 3, robots: Sequence[Path] = (), seconds: float = 20.0
) -> None:
    """Plan many goals here and over the bus, or run the services of robots; print and save the memory.

    Args:
        goals: Number of goals planned in this process.
        asked: Number of goals sent to a planner.
        seed: Of the goals.
        robots: TOML files of robots whose services are measured instead.
        seconds: Time before the services are measured.
    """
    if robots:
        found: dict[str, Any] = {path.stem: of_services(path, seconds) for path in robots}
    else:
        found = {"here": here(goals, seed), "on the wire": on_the_wire(asked, seed)}
    for name, row in found.items():
        print(name, row)
    save("memory_services" if robots else "memory", found)


if __name__ == "__main__":
    tyro.cli(main)
