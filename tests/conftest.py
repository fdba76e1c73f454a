"""One thread for linear algebra, as in the services, long tests first, and the same random examples in every run.

Several threads of linear algebra on a busy machine wait minutes for each other. `--hypothesis-profile=random` draws new
examples.
"""

import gc
import os

import pytest
from hypothesis import settings

settings.register_profile("random")
settings.register_profile("repeatable", derandomize=True, database=None)
settings.load_profile("repeatable")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy reads it when it is loaded

LONG = ("tests/system/", "tests/unit/experiments/", "tests/property/")
"""Folders whose files take longest. They run first, so that no process ends long after the others."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Move the files of `LONG` to the front; pytest-xdist hands out files in this order."""
    items.sort(key=_rank)


def _rank(item: pytest.Item) -> int:
    path = item.path.as_posix()
    return next((rank for rank, folder in enumerate(LONG) if folder in path), len(LONG))


def pytest_collection_finish() -> None:
    """Exempt all imported objects from garbage collection, as a planner does after its start.

    Its loop collects garbage ten times a second; with all of pytest's objects that would take half a core.
    """
    gc.collect()
    gc.freeze()
