"""Wait for a condition, with a timeout."""

import time
from collections.abc import Callable

PATIENCE_S = 60.0
"""Default timeout, s, long enough for a busy machine; reactions with a deadline have a bound of their own."""


class ScenarioError(Exception):
    """A scenario could not be completed."""


def wait_for(condition: Callable[[], object], what: str, patience: float = PATIENCE_S) -> float:
    """Wait until `condition` holds and return the waiting time, s.

    The last check begins after `patience` s, because a check may be slow.

    Raises:
        ScenarioError: it does not hold then.
    """
    began = time.monotonic()
    while True:
        last = time.monotonic() - began > patience
        if condition():
            return time.monotonic() - began
        if last:
            raise ScenarioError(f"waited {patience:g} s for {what}")
        time.sleep(0.002)
