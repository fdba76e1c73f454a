"""The conditions in which an arm does not follow commands."""

from protocol import messages as m

_WORDS: dict[m.Condition, str] = {
    "braking": "the arm braked by itself",
    "reflex": "the arm stopped itself in a reflex",
    "user_stopped": "the arm was stopped by its user",
    "guiding": "the arm is guided by hand",
    "not_ready": "the arm is not ready",
}


def condition_of(state: m.State) -> m.Condition:
    """Return the condition that `state` tells; an older robot side only says that it brakes."""
    return "braking" if state.brake and state.condition == "ready" else state.condition


def described(condition: m.Condition, reason: str) -> str:
    """Return a condition other than "ready" in words, with the reason that the arm gives."""
    return f"{_WORDS[condition]}: {reason}" if reason else _WORDS[condition]
