"""The drill's jumping wall clock is detected in the processes that use it."""

import subprocess
import sys
from pathlib import Path

from tools.drill.harness.shims import counts, shim

LOOK = """
import os, time
print(os.getpid())
jumps, last = 0, time.time()
while jumps < 3:
    now = time.time()
    jumps += abs(now - last) > 3600
    last = now
"""
STILL = "import os; print(os.getpid())"


def run(program: str, environment: dict[str, str]) -> int:
    """Run a program that prints its process's id, and return that."""
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    return int(done.stdout)


def test_jumps_are_counted_in_processes_with_the_shim(tmp_path: Path):
    """A process without it is left out."""
    directory = shim("jumping_clock", tmp_path)
    root = Path(__file__).parents[3]
    pids = {"sim": run(LOOK, {"PYTHONPATH": f"{directory}:{root}"}), "planner": run(STILL, {"PYTHONPATH": str(root)})}
    jumps = counts(directory, "jumps", pids)
    assert list(jumps) == ["sim"]
    assert jumps["sim"] in (3, 4), "one jump may come before the first reading"
