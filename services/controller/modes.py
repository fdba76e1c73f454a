"""The mode machine of the controller."""

from enum import StrEnum


class Mode(StrEnum):
    """Mode of the controller."""

    HOLDING = "holding"
    TRACKING = "tracking"
    STOPPING = "stopping"
    FAULT = "fault"


class Event(StrEnum):
    """Event that may change the mode."""

    ACCEPT = "accept"  # a trajectory was accepted
    CANCEL = "cancel"  # a motion must end early, also one that another controller began
    REST = "rest"  # the reference came to rest
    FAULT = "fault"  # the arm or the motion failed
    RESET = "reset"  # a client cleared the fault
    RUN = "run"  # the arm began a new run


_MOVING = {Event.ACCEPT: Mode.TRACKING, Event.CANCEL: Mode.STOPPING, Event.REST: Mode.HOLDING}
_ALWAYS = {Event.FAULT: Mode.FAULT, Event.RUN: Mode.HOLDING}

TRANSITIONS: dict[Mode, dict[Event, Mode]] = {
    Mode.HOLDING: {Event.ACCEPT: Mode.TRACKING, Event.CANCEL: Mode.STOPPING, **_ALWAYS},
    Mode.TRACKING: {**_MOVING, **_ALWAYS},
    Mode.STOPPING: {**_MOVING, **_ALWAYS},
    Mode.FAULT: {Event.RESET: Mode.HOLDING, **_ALWAYS},
}
"""Transitions; an event that is not listed changes nothing. Only `reset` and a new run end a latched fault."""


def next_mode(mode: Mode, event: Event) -> Mode:
    """Return the mode that follows `event`."""
    return TRANSITIONS[mode].get(event, mode)
