"""Statistics of states."""

import pytest

from protocol import messages as m
from tools.drill.harness.states import ticks_without_command


def states(applied: list[int], silence: int) -> list[m.State]:
    """Return states from tick 1 on: with `applied` ticks, then `silence` with the last of them; the last one brakes."""
    ticks = [*applied, *([applied[-1]] * silence)]
    return [
        m.State(
            run=1,
            tick=k,
            time=k / 1000,
            positions=[0.0],
            velocities=[0.0],
            torques=[0.0],
            saturated=[False],
            brake=k == len(ticks),
            applied_tick=tick,
        )
        for k, tick in enumerate(ticks, start=1)
    ]


@pytest.mark.parametrize("applied", [[0, 1, 2, 3], [0, 1, 1, 2]], ids=["in time", "a tick late"])
def test_silence_is_counted_from_the_last_applied_command(applied: list[int]):
    """A late command is applied one tick later, and restarts the count like any other."""
    assert ticks_without_command(states(applied, 20)) == 20
