"""States of runs, compared and counted."""

import numpy as np

from protocol import messages as m


def gaps(states: list[m.State]) -> int:
    """Return how many ticks are missing or duplicated among the states."""
    return int(np.sum(np.diff([state.tick for state in states]) != 1))


def differing(one: list[bytes], other: list[bytes]) -> int:
    """Return how many states of two runs differ in a bit; those that only one run has differ."""
    return sum(a != b for a, b in zip(one, other, strict=False)) + abs(len(one) - len(other))
