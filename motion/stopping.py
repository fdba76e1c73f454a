"""Which final accelerations, and which final velocities, leave room for the stop after the hit (design 1.9)."""

from collections.abc import Callable

import numpy as np

from motion.errors import CannotStop
from motion.fixed import FIXED_TOLERANCE
from motion.limits import Limits
from motion.request import MotionRequest
from motion.tail import TOUCH, UNLIMITED, stop_extremes

_POINTS = 257
_ROUNDS = 3


def final_accelerations(request: MotionRequest) -> np.ndarray:
    """The interval (J, 2) in which each joint's acceleration at the end of its moving part has to lie.

    A given acceleration is an interval of no width. With the tail "stop" a free one is confined to where the
    stop from it stays inside the position and velocity limits. Raises CannotStop where there is none.
    """
    limits, wanted = request.limits, request.final_accelerations()
    positions, velocities = request.goal.positions, request.goal.velocities
    # A joint that arrives at its velocity limit has come from inside it.
    fastest = limits.velocities * (1 - FIXED_TOLERANCE)
    low = np.where(np.isnan(wanted), np.where(velocities >= fastest, 0.0, -limits.accelerations), wanted)
    high = np.where(np.isnan(wanted), np.where(velocities <= -fastest, 0.0, limits.accelerations), wanted)
    if request.tail == "coast":
        return np.stack([low, high], axis=1)
    low, high = _stoppable(positions, velocities, low, high, limits)
    stuck = np.flatnonzero(~(low <= high))
    if stuck.size:
        joint = int(stuck[0])
        raise CannotStop(joint, _max_velocity(request, joint, wanted[joint]))
    return np.stack([low, high], axis=1)


def _stoppable(
    positions: np.ndarray, velocities: np.ndarray, low: np.ndarray, high: np.ndarray, limits: Limits
) -> tuple[np.ndarray, np.ndarray]:
    """The part of [low, high] from which a stop stays inside; empty where low > high. All (J,).

    Both extremes of position and of velocity grow with the acceleration the stop starts from. That of velocity is
    v + a|a|/2J; only where the position limit is in reach as well does it take a search.
    """
    jerks = 2 * np.minimum(limits.jerks, UNLIMITED)
    fastest = limits.velocities + TOUCH
    low = np.maximum(np.clip(low, -UNLIMITED, UNLIMITED), -np.sqrt(np.maximum(jerks * (fastest + velocities), 0.0)))
    high = np.minimum(np.clip(high, -UNLIMITED, UNLIMITED), np.sqrt(np.maximum(jerks * (fastest - velocities), 0.0)))
    lowest, highest = limits.positions[:, 0] - TOUCH, limits.positions[:, 1] + TOUCH
    ends = stop_extremes(positions, velocities, np.stack([low, high]), limits.accelerations, limits.jerks)
    below_at_low, below_at_high = ends[1] <= highest
    above_at_low, above_at_high = ends[0] >= lowest

    def below(a: np.ndarray) -> np.ndarray:
        _, p_max, _, _ = stop_extremes(positions, velocities, a, limits.accelerations, limits.jerks)
        return p_max <= highest

    def above(a: np.ndarray) -> np.ndarray:
        p_min, _, _, _ = stop_extremes(positions, velocities, -a, limits.accelerations, limits.jerks)
        return p_min >= lowest

    bottom = -_largest(above, -high, -low, above_at_high, above_at_low)
    top = _largest(below, low, high, below_at_low, below_at_high)
    return np.where(low <= high, bottom, np.inf), top


def _largest(
    holds: Callable[[np.ndarray], np.ndarray],
    low: np.ndarray,
    high: np.ndarray,
    somewhere: np.ndarray,
    everywhere: np.ndarray,
) -> np.ndarray:
    """The largest values (J,) in [low, high] at which a predicate that turns false once still holds.

    −inf where it does not even hold at `low`. The predicate takes (n, J); `somewhere` and `everywhere` (J,) are what
    it says at `low` and `high`.
    """
    if everywhere.all():
        return high
    left, right = low, high
    for _ in range(_ROUNDS):
        points = left + (right - left) * np.linspace(0, 1, _POINTS)[:, None]
        points[0] = left
        last = np.maximum(np.logical_and.accumulate(holds(points), axis=0).sum(axis=0) - 1, 0)
        joints = np.arange(len(low))
        left, right = points[last, joints], points[np.minimum(last + 1, _POINTS - 1), joints]
    return np.where(everywhere, high, np.where(somewhere, left, -np.inf))


def _max_velocity(request: MotionRequest, joint: int, acceleration: float) -> float:
    """The largest velocity, in the direction asked for, from which one joint could stop; 0 if there is none.

    `acceleration` is the final one if it is given, NaN if it is free. A little below the bound itself.
    """
    limits = request.limits
    sign = float(np.sign(request.goal.velocities[joint])) or 1.0

    def stoppable(speeds: np.ndarray) -> np.ndarray:
        count = speeds.size
        one = Limits(
            np.repeat(limits.positions[joint : joint + 1], count, axis=0),
            *(np.full(count, x[joint]) for x in (limits.velocities, limits.accelerations, limits.jerks)),
        )
        free = np.isnan(acceleration)
        low = np.full(count, -limits.accelerations[joint] if free else acceleration)
        high = np.full(count, limits.accelerations[joint] if free else acceleration)
        position = np.full(count, request.goal.positions[joint])
        low, high = _stoppable(position, sign * speeds.ravel(), low, high, one)
        return (low <= high).reshape(speeds.shape)

    top = np.array([abs(request.goal.velocities[joint])])
    largest = float(_largest(stoppable, np.zeros(1), top, stoppable(np.zeros(1)), stoppable(top))[0])
    return sign * max(largest, 0.0) * (1 - 1e-6)
