"""`python -m benchmarks.memory`: resident memory over many goals, in this process and in a planner on the bus."""

import gc
from dataclasses import replace
from pathlib import Path

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

MARKS = 20
"""Number of readings of the memory."""


def resident_kb(process: int | str = "self") -> int:
    """Return the resident memory of a process, kB."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))


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
            kilobytes.append(resident_kb())
    kilobytes.append(resident_kb())
    return {"goals": goals, "refused": refused, "resident_kB": kilobytes}


def on_the_wire(goals: int, seed: int) -> dict[str, object]:
    """Send plan-only goals to a planner without an arm, a tenth of them with the trajectory in the reply."""
    rng, kilobytes = np.random.default_rng(seed), []
    with running_cell(names=["planner"], quiet=True) as cell:
        for k in track(range(goals), "asked of a planner"):
            cell.bus.ask(topics.GOAL, tight_goal(rng, plan_only=True, duration=0.8, include_trajectory=k % 10 == 0))
            if k % max(1, goals // MARKS) == 0:
                kilobytes.append(resident_kb(cell.services.running["planner"].pid))
    return {"goals": goals, "resident_kB": kilobytes}


def main(goals: int = 100_000, asked: int = 100_000, seed: int = 3) -> None:
    """Plan this many goals here and over the bus; print and save the resident memory."""
    found = {"here": here(goals, seed), "on the wire": on_the_wire(asked, seed)}
    for name, row in found.items():
        print(name, row)
    save("memory", found)


if __name__ == "__main__":
    tyro.cli(main)
