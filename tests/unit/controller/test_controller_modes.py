"""The mode machine, over every mode and event."""

import pytest

from services.controller.modes import TRANSITIONS, Event, Mode, next_mode

EXPECTED = {
    # what happens: holding, tracking, stopping, fault become
    Event.ACCEPT: (Mode.TRACKING, Mode.TRACKING, Mode.TRACKING, Mode.FAULT),
    Event.CANCEL: (Mode.STOPPING, Mode.STOPPING, Mode.STOPPING, Mode.FAULT),
    Event.REST: (Mode.HOLDING, Mode.HOLDING, Mode.HOLDING, Mode.FAULT),
    Event.FAULT: (Mode.FAULT, Mode.FAULT, Mode.FAULT, Mode.FAULT),
    Event.RESET: (Mode.HOLDING, Mode.TRACKING, Mode.STOPPING, Mode.HOLDING),
    Event.RUN: (Mode.HOLDING, Mode.HOLDING, Mode.HOLDING, Mode.HOLDING),
}


@pytest.mark.parametrize("event", Event)
def test_every_event_in_every_mode(event: Event):
    """Above all a fault is left by a reset or a new run alone."""
    assert tuple(next_mode(mode, event) for mode in Mode) == EXPECTED[event]


def test_every_mode_is_in_the_table():
    """A mode without a row would raise where it is first met: in the loop."""
    assert set(TRANSITIONS) == set(Mode)
