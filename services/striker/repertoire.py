"""The primitives that the striker imitates."""

import math
from collections.abc import Sequence

from motion.listing import listed
from protocol.errors import Refusal
from protocol.topics import MAX_ID
from services.striker.messages import READY


class Repertoire:
    """Name and duration (s) of an arm's primitives. home: the primitive of the return, empty if there is none."""

    def __init__(self, library: Sequence[tuple[str, float]]) -> None:
        self.home = READY if READY in dict(library) else ""
        self._strikes = {name: duration for name, duration in library if name != READY}

    def check(self, primitives: tuple[str, ...]) -> None:
        """Check that these primitives may be imitated; none means any.

        Raises:
            Refusal: `unknown_primitive`.
        """
        if not self._strikes:
            raise Refusal("unknown_primitive", "the library has no primitive of this arm; teach it a strike", name="")
        for name in primitives:
            if name not in self._strikes:
                sentence = f"there is no primitive {name[:MAX_ID]!r}; the library has {listed(sorted(self._strikes))}"
                raise Refusal("unknown_primitive", sentence, name=name[:MAX_ID])

    def nearest(self, left: float, primitives: tuple[str, ...]) -> str:
        """Return the one of `primitives` (empty: all) whose duration is nearest to `left`, s."""
        durations = {name: self._strikes[name] for name in primitives or self._strikes}
        return min(durations, key=lambda name: abs(math.log(durations[name] / max(left, 1e-3))))
