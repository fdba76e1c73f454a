"""Wait for state that takes a moment to propagate: routes, tokens, messages."""

import time
from collections.abc import Callable

PATIENCE_S = 60.0


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
        time.sleep(0.01)
