"""Compare and count the states of runs."""

import numpy as np

from protocol import messages as m


def missing_ticks(states: list[m.State]) -> int:
    """Count the steps between consecutive states that are not one tick."""
    return int(np.sum(np.diff([state.tick for state in states]) != 1))


def differing_states(one: list[bytes], other: list[bytes]) -> int:
    """Count the states of two runs that are not bit-identical, and those that only one run has."""
    return sum(a != b for a, b in zip(one, other, strict=False)) + abs(len(one) - len(other))


def ticks_without_command(states: list[m.State]) -> int:
    """Count the ticks from the last new command to the first state in which the arm brakes; no state may be missing.

    In real time the last command may arrive, and be applied, a tick late.
    """
    first = next(state for state in states if state.brake)
    applied = next(state for state in states if state.applied_tick == first.applied_tick)
    return first.tick - applied.tick
