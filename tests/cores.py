"""Which core the loops of a test's cells run on."""

import os

CORES = sorted(os.sched_getaffinity(0))
WORKER = os.environ.get("PYTEST_XDIST_WORKER", "")
LOOP_CORE = CORES[-1 - int(WORKER.removeprefix("gw")) % len(CORES)] if WORKER else None
"""One for each worker. By default all cells share the last core, where the paced ones of one worker come first: the
stepped ones of another then get so little of it that requests time out."""
