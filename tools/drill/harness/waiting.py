"""Wait for a condition, with a timeout."""

import time
from collections.abc import Callable

PATIENCE_S = 60.0
"""Default timeout, s, long enough for a busy machine; reactions with a deadline have a bound of their own."""


class ScenarioError(Exception):
    """A scenario could not be completed."""


def eventually(condition: Callable[[], object], patience: float = PATIENCE_S) -> bool:
    """Wait until `condition` holds, and return whether it did.

    The last check begins after `patience` s, because a check may be slow.
    """
    end = time.monotonic() + patience
    while True:
        last = time.monotonic() > end
        if condition():
            return True
        if last:
            return False
        time.sleep(0.002)


def wait_for(condition: Callable[[], object], what: str, patience: float = PATIENCE_S) -> float:
    """Wait until `condition` holds as `eventually` does, and return the waiting time, s.

    Raises:
        ScenarioError: it does not hold after `patience` s.
    """
    began = time.monotonic()
    if not eventually(condition, patience):
        raise ScenarioError(f"waited {patience:g} s for {what}")
    return time.monotonic() - began
