"""What tests of the planner share."""

import gc
from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module", autouse=True)
def frozen_garbage() -> Iterator[None]:
    """Leave what pytest has to no collection, as a planner does with what it started with.

    The planner's loop collects ten times a second: here that would take half a core, before all ordinary processes.
    """
    gc.freeze()
    yield
    gc.unfreeze()
