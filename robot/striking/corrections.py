"""Corrections of a hit, in the order in which they are planned until one is inside the limits."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robot.striking.choice import Choice, NoHit, State, unlike_first
from robot.striking.chooser import Chooser
from robot.striking.estimator import Estimator

HORIZON_S = 1.5
"""How far ahead, s, a ball is predicted for hits that are not near an earlier one."""
ELSEWHERE_S = 0.15
"""Until so long before the touch such hits are looked for."""
BETTER = 0.8
"""Others that come before the near ones expect to land at most this part of their distance from the target."""


@dataclass(frozen=True, slots=True, eq=False)
class Corrections:
    """Finds corrections of hits.

    tries: how many hits near the last one come at most, and how many others. hopeless: m; others come first where the
    best near one expects to land so far from the target. earliest: s, no hit sooner than this and than the last one,
    but where no later one is left.
    """

    chooser: Chooser
    estimator: Estimator
    tries: int
    hopeless: float = np.inf
    earliest: float = -np.inf

    def of(self, last: Choice, start: State, target: np.ndarray) -> Iterator[Choice]:
        """Yield hits near the last one, then, where there is time, any others, then what touches the ball at least.

        Nothing is searched for before it is taken. start: where the corrected motion begins.

        Raises:
            NoHit: there is none at all.
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
        """Yield hits anywhere that expect to land nearer to the target than `within`, m; there may be none."""
        path = self.estimator.path(start.time + HORIZON_S)
        try:
            found = self.chooser.choose(path, start, target, None, earliest, self.tries, within, refine=False)
        except NoHit:
            return
        yield from unlike_first(found)
