"""One thread for linear algebra, as in the services: several threads on a busy machine wait minutes for each other."""

import gc
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy reads it when it is loaded


def pytest_collection_finish() -> None:
    """Exempt all imported objects from garbage collection, as a planner does after its start.

    Its loop collects garbage ten times a second; with all of pytest's objects that would take half a core.
    """
    gc.collect()
    gc.freeze()
