"""Wait for state that takes a moment to propagate: routes, tokens, messages."""

import time
from collections.abc import Callable

PATIENCE_S = 60.0


def eventually(condition: Callable[[], object], patience: float = PATIENCE_S) -> bool:
    """Wait until `condition` holds, at most `patience` s, and return whether it did."""
    end = time.monotonic() + patience
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True
