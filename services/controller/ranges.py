"""Ranges for the checks of sampled and of polynomial trajectories, and the refusal of a value outside."""

import math

import numpy as np

from motion.limits import QUANTITIES, RETURN_BY, RETURN_FROM, Limits
from protocol.errors import Refusal
from robot.conversions import unit_of
from robot.description import RobotConfig

TIGHT = 1e-6
"""Tolerance for rounding, as a fraction of the range."""


def slack(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the tolerance of low … high (J,), 0 for an infinite range."""
    width = high - low
    return np.where(np.isfinite(width), TIGHT * width, 0.0)


def return_ranges(first: np.ndarray, limits: Limits) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest positions (J,) for the first part of a motion that starts at `first` (J,).

    A joint that was pushed slightly beyond its limit may start there, but not move farther out.
    """
    low, high = limits.positions.T
    lowest = np.minimum(low, np.maximum(first, low - RETURN_FROM))
    return lowest, np.maximum(high, np.minimum(first, high + RETURN_FROM))


def return_ticks(hit_index: int) -> int:
    """Return the tick from which a motion with its hit at `hit_index` must be inside the position limits."""
    return math.ceil(RETURN_BY * hit_index) + 1


def limit_refusal(
    quantity: str, joint: int, value: float, bounds: tuple[float, float], where: str, config: RobotConfig
) -> Refusal:
    """Return the refusal of a value beyond its bounds; `where` names the sample or time.

    It names the limit of the robot, also where a motion that starts outside may keep a wider one for a while.
    """
    low, high = config.limits.ranges[joint, QUANTITIES.index(quantity)].tolist()
    name, bound = config.joint_names[joint], low if value < bounds[0] else high
    unit = unit_of(quantity, config.slides[joint])
    sentence = (
        f"the {quantity} of {name} is {value:.6g} {unit} at {where}, beyond its limit of {bound:.6g} {unit}; "
        "plan inside the limits of `description`"
    )
    return Refusal("limit", sentence, joint=name, quantity=quantity, value=value, bound=bound)
