"""Waiting for what takes a moment to get around: routes, tokens, messages."""

import time
from collections.abc import Callable

PATIENCE_S = 60.0


def eventually(condition: Callable[[], object], patience: float = PATIENCE_S) -> bool:
    """Wait until something holds, and return whether it did within `patience` s."""
    end = time.monotonic() + patience
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True
