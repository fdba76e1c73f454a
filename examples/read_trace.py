"""Read a trace into NumPy: measured and reference positions at each tick, and the events of goals.

    volley up --record strike.rrd                        # in another shell; end it with Ctrl-C after a goal
    python examples/read_trace.py strike.rrd

A trace is a Rerun recording: `rerun strike.rrd` shows it, and `rerun.chunk` reads it without Volley. docs/trace.md
lists its entities.
"""

import sys
from pathlib import Path

import numpy as np

from tools.trace_reader import read_trace


def main(file: str) -> None:
    """Print each joint's range and error, and the events of goals."""
    trace = read_trace(Path(file))
    joints = [entity.split("/")[2] for entity in trace.entities if entity.endswith("/position/measured")]
    for name in joints:
        measured = trace.column(f"/joints/{name}/position/measured")
        reference = trace.column(f"/joints/{name}/position/reference")
        # A command answers the state of its own tick, so rows of one tick belong together.
        _, here, there = np.intersect1d(measured.ticks(), reference.ticks(), return_indices=True)
        error = measured.array()[here] - reference.array()[there]
        low, high = measured.array().min(), measured.array().max()
        print(f"{name}: {len(here)} ticks, {low:.3f} to {high:.3f} rad, error {np.abs(error).max():.1e} rad at most")
    for sentence in trace.texts("/events/goal"):
        print(sentence)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python examples/read_trace.py TRACE.rrd")
    main(sys.argv[1])
