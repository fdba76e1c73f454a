"""Candidate times of a hit."""

import numpy as np

from robot.striking.choice import NoHit
from robot.striking.options import Options
from robot.striking.path import Path


def touch_times(path: Path, fixed: np.ndarray, options: Options, begin: float, earliest: float = -np.inf) -> np.ndarray:
    """Return times (n,), s, at which a ball is not in a bounce and was never near the points `fixed` (m, 3).

    begin: s, of the arm's motion. earliest: s, lower bound.

    Raises:
        NoHit: there is no such time.
    """
    first = max(begin + options.min_motion_time, earliest, float(path.times[0]))
    times = np.arange(first, path.times[-1] - 1e-9, options.time_step)
    times = times[path.bounced(times) % 1 == 0] if len(times) else times
    if not len(times):
        raise NoHit("late", f"the ball is gone before the arm could move for {options.min_motion_time:g} s")
    times = times[times < path.first_time_near(fixed, options.base_distance)]
    if not len(times):
        raise NoHit("out of reach", "the ball's path meets the arm's base before the arm could move")
    return times
