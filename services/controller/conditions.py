"""The condition of the arm, and the faults that follow from it."""

from protocol import messages as m
from protocol.errors import Refusal

_WORDS: dict[m.Condition, str] = {
    "braking": "the arm braked by itself",
    "reflex": "the arm stopped itself in a reflex",
    "user_stopped": "the arm was stopped by its user",
    "guiding": "the arm is guided by hand",
    "not_ready": "the arm is not ready",
}


class ArmCondition:
    """Whether the arm follows commands.

    Attributes:
        now: As the newest state of the run has it.
        sentence: A condition other than "ready" in words, with the reason that the arm gives.
    """

    def __init__(self) -> None:
        self.now: m.Condition = "ready"
        self.sentence = ""
        self._release_by = 0

    def update(self, state: m.State, in_fault: bool) -> str | None:
        """Take the condition of `state`; return why it is a fault of the controller, or None.

        A fault is a condition that sets in, and a brake that is still applied once it should have been released.
        """
        before, self.now = self.now, state.condition
        if self.now == "ready":
            if not state.brake:
                return None
            self.now = "braking"  # an older robot side publishes no condition
        self.sentence = f"{_WORDS[self.now]}: {state.reason}" if state.reason else _WORDS[self.now]
        if self.now != before:
            return self.sentence
        if self.now == "braking" and not in_fault and state.tick > self._release_by:
            return "the arm still brakes, held too far from where it is measured; send `reset`"
        return None

    def require(self, cure: str, *allowed: m.Condition) -> None:
        """Return where the condition is one of those `allowed`.

        Raises:
            Refusal: `fault`, with the condition in words and its cure.
        """
        if self.now not in allowed:
            raise Refusal("fault", f"{self.sentence}; {cure}", fault=self.sentence)

    def expect_release(self, tick: int) -> None:
        """Expect the arm to have released its brake by `tick`."""
        self._release_by = tick
