"""Limits that no motion through the prescribed values can keep, found without a program.

A divided difference of the prescribed values is, up to a factor, a mean of a derivative of every motion through them
(mean value theorem). If a mean exceeds a limit, the motion does too, whatever its functions.
"""

from dataclasses import dataclass, field

import numpy as np

from motion.errors import NONE_TRIED, Infeasible
from motion.limits import QUANTITIES, Limits
from motion.program.equalities import Fixed
from motion.request import MotionRequest


@dataclass(eq=False)
class InfeasibleRows(Exception):
    """The limits of one joint contradict each other; `quantity` (0 to 3) and `s` name the hardest one, and where.

    rows, multipliers: rows that contradict each other with these weights; empty if it was found without a program.
    """

    joint: int
    quantity: int
    s: float
    rows: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    multipliers: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def error(
        self,
        request: MotionRequest,
        min_duration: float | None = None,
        waypoint_times: list[float] | None = None,
        otherwise: str = NONE_TRIED,
    ) -> Infeasible:
        """Return the error of `request`, with what works or the advice `otherwise`."""
        low, high = request.limits.ranges[self.joint, self.quantity].tolist()
        what, time = QUANTITIES[self.quantity], self.s * request.moving_duration
        return Infeasible(self.joint, what, time, (low, high), min_duration, waypoint_times, otherwise)


def hardest_limit(quantity: np.ndarray, s: np.ndarray, multipliers: np.ndarray) -> tuple[int, float]:
    """Return the quantity whose rows (n,) have the largest sum of multipliers, and the s of its largest multiplier."""
    hardest = int(np.bincount(quantity, weights=multipliers, minlength=4).argmax())
    return hardest, float(s[np.where(quantity == hardest, multipliers, -1.0).argmax()])


def check_means(fixed: Fixed, duration: float, limits: Limits) -> None:
    """Raise InfeasibleRows if a mean velocity, acceleration or jerk exceeds its limit; duration: of the moving part, s.

    The joint's mean that exceeds its limit most, of the lowest such derivative, is named.
    """
    places = fixed.s[::3]
    positions, velocities, accelerations = (fixed.values[k::3] for k in range(3))
    span = duration * (places[1:] - places[:-1])[:, None]
    # Of each interval: the means over all of it, and weighted towards its begin and its end.
    speed = (positions[1:] - positions[:-1]) / span
    early, late = (speed - velocities[:-1]) * (2 / span), (velocities[1:] - speed) * (2 / span)
    jerks = early - accelerations[:-1], late - early, accelerations[1:] - late
    speeds, bends, jerks = [speed], [early, late], [each * (3 / span) for each in jerks]
    if len(places) > 2:  # over two and three intervals, from positions alone
        bends.append(2 * np.diff(speed, axis=0) / (span[1:] + span[:-1]))
        jerks.append(3 * np.diff(bends[-1], axis=0) / (span[2:] + span[1:-1] + span[:-2]))
    for quantity, means in enumerate((speeds, bends, jerks), 1):
        values, bound = abs(np.concatenate(means)), limits.ranges[:, quantity, 1]
        if (values > bound + limits.slack[:, quantity]).any():
            row, joint = divmod(int(np.nan_to_num(values / bound).argmax()), len(bound))
            raise InfeasibleRows(joint, quantity, float(np.concatenate([_middles(places, len(m)) for m in means])[row]))


def _middles(places: np.ndarray, count: int) -> np.ndarray:
    """Middles (count,) of all windows of as many neighbouring places as there are `count` of them."""
    width = len(places) - count
    return (places[width:] + places[:count]) / 2
