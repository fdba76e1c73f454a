"""One thread for linear algebra, as in the services: on a busy machine several wait for each other for minutes."""

import gc
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is loaded


def pytest_collection_finish() -> None:
    """Leave what was imported to no collection, as a planner does with what it started with.

    Its loop collects ten times a second: among all of pytest's objects that takes half a core, before other processes.
    """
    gc.collect()
    gc.freeze()
