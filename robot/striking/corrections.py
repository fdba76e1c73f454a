"""Corrections of a hit, in the order in which they are planned until one is feasible."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robot.striking.choice import Choice, NoHit, State, distinct_first
from robot.striking.chooser import Chooser
from robot.striking.estimator import Estimator

HORIZON_S = 1.5
"""Prediction horizon of the ball, s, for hits that are not near the last one."""
ELSEWHERE_S = 0.15
"""Such hits are searched until this long before the touch, s."""
BETTER = 0.8
"""Hits elsewhere precede the near ones if their expected landing error is at most this part of the near ones'."""


@dataclass(frozen=True, slots=True, eq=False)
class Corrections:
    """Finds corrections of hits.

    tries: largest number of hits near the last one, and of hits elsewhere. hopeless: m, expected landing error of the
    best near hit above which hits elsewhere come first. earliest: s; hits before this time, or before the last hit if
    that is earlier, are only taken if no later one is left.
    """

    chooser: Chooser
    estimator: Estimator
    tries: int
    hopeless: float = np.inf
    earliest: float = -np.inf

    def of(self, last: Choice, start: State, target: np.ndarray) -> Iterator[Choice]:
        """Yield hits near the last one, then, if there is time, hits elsewhere, then hits that only touch the ball.

        Each is computed when it is taken. start: state in which the corrected motion begins.

        Raises:
            NoHit: there is no correction.
        """
        path, soonest = self.estimator.path(last.time + 0.1), min(last.time, self.earliest) - 1e-6
        may_look = last.time - start.time > ELSEWHERE_S
        try:
            near = self.chooser.correct(path, start, target, last, soonest, self.tries)
        except NoHit:
            others = list(self._others(start, target)) if may_look else []
            yield from others
            touches = self.chooser.touches(path, start, target, last)
            yield from touches
            if not (others or touches):
                raise
            return
        best = next(near)
        hopeless = best.error > self.hopeless
        if may_look and hopeless:
            yield from self._others(start, target, soonest, BETTER * best.error)
        yield best
        yield from near
        if may_look and not hopeless:
            yield from self._others(start, target)
        yield from self.chooser.touches(path, start, target, last)

    def _others(
        self, start: State, target: np.ndarray, earliest: float = -np.inf, within: float = np.inf
    ) -> Iterator[Choice]:
        """Yield hits anywhere with an expected landing error below `within`, m; possibly none."""
        path = self.estimator.path(start.time + HORIZON_S)
        try:
            found = self.chooser.choose(path, start, target, None, earliest, self.tries, within, refine=False)
        except NoHit:
            return
        yield from distinct_first(found)
