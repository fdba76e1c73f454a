"""States of runs, compared and counted."""

import numpy as np

from protocol import messages as m


def gaps(states: list[m.State]) -> int:
    """Return how many ticks are missing or duplicated among the states."""
    return int(np.sum(np.diff([state.tick for state in states]) != 1))


def differing(one: list[bytes], other: list[bytes]) -> int:
    """Return how many states of two runs differ in a bit; those that only one run has differ."""
    return sum(a != b for a, b in zip(one, other, strict=False)) + abs(len(one) - len(other))


def silent_ticks(states: list[m.State]) -> int:
    """Return how many ticks passed without a fresh command before the first state of a brake; none may be missing.

    In real time the last command may come in a tick late, and is applied then.
    """
    first = next(state for state in states if state.brake)
    applied = next(state for state in states if state.applied_tick == first.applied_tick)
    return first.tick - applied.tick
