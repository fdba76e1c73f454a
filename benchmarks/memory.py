"""`python -m benchmarks.memory`: the memory that planning takes over many goals, resident, in this process."""

import gc
from dataclasses import replace
from pathlib import Path

import numpy as np
import tyro

from benchmarks.cases import draw, forehand
from benchmarks.machine import save
from motion.errors import MotionError
from motion.plan import plan
from motion.request import Waypoint


def resident_kb() -> int:
    """Resident memory of this process, kB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))


def main(goals: int = 100_000, seed: int = 3) -> None:
    """Plan this many six-joint goals, warm, a tenth of them with way-points of their own time, and say what it took."""
    primitive, rng = forehand(), np.random.default_rng(seed)
    requests = [case.request for case in draw(primitive, 20, seed)]
    warm, refused, kilobytes = None, 0, []
    for k in range(goals):
        request = requests[k % len(requests)]
        duration = request.duration * rng.uniform(1.0, 1.05)
        time = duration * rng.uniform(0.3, 0.7)
        through = primitive.demonstrated_positions(np.array([time / duration]))[0]
        waypoints = () if k % 10 else (Waypoint(time, through, np.full(request.joint_count, np.nan)),)
        try:
            made = plan(primitive, replace(request, duration=duration, waypoints=waypoints), warm=warm)
            made.samples()
            warm = made.warm
        except MotionError:
            refused += 1
        if k % max(1, goals // 20) == 0:
            gc.collect()
            kilobytes.append(resident_kb())
    kilobytes.append(resident_kb())
    print(f"{goals} goals, {refused} refused; resident kB along the way: {kilobytes}")
    save("memory", {"goals": goals, "refused": refused, "resident_kB": kilobytes})


if __name__ == "__main__":
    tyro.cli(main)
