"""Learn a primitive from a CSV file, print how well it was learned, play it, and forget it.

    volley up                                          # in another shell
    python examples/learn_csv.py [ENDPOINT [FILE.csv]]

The file has a header, then one row for each sample: time in s, then the joints in rad. Without FILE.csv the program
learns the shipped forehand under another name.
"""

import sys
from pathlib import Path

import numpy as np

from client import connect

SHIPPED = Path(__file__).parents[1] / "deploy" / "demonstrations" / "forehand.csv"
NAME = "from-csv"


def main(endpoint: str | None = None, file: str | Path = SHIPPED) -> None:
    """Learn, play, forget."""
    table = np.loadtxt(file, delimiter=",", skiprows=1)
    with connect(endpoint) as arm:
        learned = arm.learn(NAME, table[:, 1:], times=table[:, 0], replace=True)
        print(f"learned {learned.name}: {learned.duration:.3f} s, {learned.basis_count} functions a joint")
        print("largest distance from the samples:", f"{max(learned.position_max):.2g} rad")
        for warning in learned.warnings:
            print("warning:", warning)
        result = arm.goal(NAME).wait()
        print("played:", result.outcome)
        arm.forget(NAME)
        print("library:", ", ".join(entry.name for entry in arm.primitives()))


if __name__ == "__main__":
    main(*sys.argv[1:])
