"""Wait for what a scenario needs, and what it raises where that does not come."""

import time
from collections.abc import Callable

PATIENCE_S = 60.0
"""How long anything may take on a busy machine; what must be quick has a bound of its own."""


class ScenarioError(Exception):
    """A scenario could not be carried out."""


def wait_for(condition: Callable[[], object], what: str, patience: float = PATIENCE_S) -> float:
    """Wait until `condition` holds and return how long that took, s.

    Raises:
        ScenarioError: it did not within `patience` s.
    """
    began = time.monotonic()
    while not condition():
        if time.monotonic() - began > patience:
            raise ScenarioError(f"waited {patience:g} s for {what}")
        time.sleep(0.002)
    return time.monotonic() - began
