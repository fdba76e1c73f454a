"""The core on which the loops of a test's cells run."""

import os

CORES = sorted(os.sched_getaffinity(0))
WORKER = os.environ.get("PYTEST_XDIST_WORKER", "")
LOOP_CORE = CORES[-1 - int(WORKER.removeprefix("gw")) % len(CORES)] if WORKER else None
"""One core for each pytest worker.

On a shared core the paced cells of one worker have priority, and the stepped cells of another get so little time that
requests time out."""
