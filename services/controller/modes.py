"""The modes of the controller and what leads from one to the next."""

from enum import StrEnum


class Mode(StrEnum):
    """What the controller is doing."""

    HOLDING = "holding"
    TRACKING = "tracking"
    STOPPING = "stopping"
    FAULT = "fault"


class Event(StrEnum):
    """What can happen to it."""

    ACCEPT = "accept"  # a trajectory was taken on
    CANCEL = "cancel"  # a motion is to end early
    REST = "rest"  # the reference came to rest
    FAULT = "fault"  # something broke
    RESET = "reset"  # somebody cleared the fault
    RUN = "run"  # a new life of the arm began


_MOVING = {Event.ACCEPT: Mode.TRACKING, Event.CANCEL: Mode.STOPPING, Event.REST: Mode.HOLDING}
_ALWAYS = {Event.FAULT: Mode.FAULT, Event.RUN: Mode.HOLDING}

TRANSITIONS: dict[Mode, dict[Event, Mode]] = {
    Mode.HOLDING: {Event.ACCEPT: Mode.TRACKING, **_ALWAYS},
    Mode.TRACKING: {**_MOVING, **_ALWAYS},
    Mode.STOPPING: {**_MOVING, **_ALWAYS},
    Mode.FAULT: {Event.RESET: Mode.HOLDING, **_ALWAYS},
}
"""What is not listed changes nothing: above all, a latched fault accepts nothing but `reset` and a new run."""


def next_mode(mode: Mode, event: Event) -> Mode:
    """Return the mode that follows `event`."""
    return TRANSITIONS[mode].get(event, mode)
