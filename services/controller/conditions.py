"""The arm's condition, and the faults that it causes."""

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
    """Condition of the arm: whether it follows commands.

    Attributes:
        now: The condition in the newest state of the run.
        sentence: A condition other than "ready" in words, with the arm's reason.
    """

    def __init__(self) -> None:
        self.now: m.Condition = "ready"
        self.sentence = ""
        self._release_by = 0

    def update(self, state: m.State, in_fault: bool) -> str | None:
        """Update the condition from `state`; return the reason of a controller fault, or None.

        It is a fault if the arm leaves "ready", or if it still brakes after it should have released the brake.
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
        """Check that the condition is one of those `allowed`.

        Raises:
            Refusal: `fault`, with the condition in words and its cure.
        """
        if self.now not in allowed:
            raise Refusal("fault", f"{self.sentence}; {cure}", fault=self.sentence)

    def expect_release(self, tick: int) -> None:
        """Expect the arm to have released its brake by `tick`."""
        self._release_by = tick
