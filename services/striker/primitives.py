"""The primitives that the striker imitates."""

import math
from collections.abc import Sequence

from motion.listing import listed
from protocol.errors import Refusal
from protocol.topics import MAX_ID
from services.striker.messages import READY


class StrikePrimitives:
    """Name and duration (s) of an arm's primitives. ready: the primitive of the return, empty if there is none."""

    def __init__(self, library: Sequence[tuple[str, float]]) -> None:
        self.ready = READY if READY in dict(library) else ""
        self._strikes = {name: duration for name, duration in library if name != READY}

    def check(self, allowed: tuple[str, ...]) -> None:
        """Check that these primitives exist; none allows all.

        Raises:
            Refusal: `unknown_primitive`.
        """
        if not self._strikes:
            raise Refusal("unknown_primitive", "the library has no primitive of this arm; teach it a strike", name="")
        for name in allowed:
            if name not in self._strikes:
                sentence = f"there is no primitive {name[:MAX_ID]!r}; the library has {listed(sorted(self._strikes))}"
                raise Refusal("unknown_primitive", sentence, name=name[:MAX_ID])

    def nearest(self, duration: float, allowed: tuple[str, ...]) -> str:
        """Return the one of `allowed` (empty: all) whose duration is nearest to `duration`, s."""
        durations = {name: self._strikes[name] for name in allowed or self._strikes}
        return min(durations, key=lambda name: abs(math.log(durations[name] / max(duration, 1e-3))))
