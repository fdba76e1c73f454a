"""Conversions between the arrays of `motion` and the messages of `protocol`."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from motion.errors import UNITS
from motion.limits import QUANTITIES, Limits
from motion.trajectory import Samples
from protocol import messages as m
from protocol.codec import matrix, matrix_bytes
from protocol.errors import Refusal
from robot.motion_check import Collides

MATRICES = "positions", "velocities", "accelerations"
"""The fields of `Samples`, and of a trajectory that is sent as samples."""

QUANTITY_OF: Mapping[str, str] = dict(zip((*MATRICES, "jerks"), QUANTITIES, strict=True))
"""The quantity of each field."""


def samples_of(trajectory: m.Trajectory | m.Plan) -> Samples:
    """Return the samples (count, J) of a trajectory on the wire.

    Raises Refusal `bad_message` where a matrix has another size, or a number that is not finite.
    """
    shape = trajectory.count, len(trajectory.joint_names)
    return Samples(*(matrix(getattr(trajectory, name), *shape, name) for name in MATRICES))


def sample_matrices(samples: Samples) -> dict[str, Any]:
    """Return samples (n, J) as the three fields of a trajectory on the wire."""
    return {name: matrix_bytes(getattr(samples, name)) for name in MATRICES}


def finite_or_null(values: np.ndarray) -> list[float | None]:
    """Return limits (J,) as a list, with null for no limit (±inf)."""
    return [value if np.isfinite(value) else None for value in values.tolist()]


def limit_fields(limits: Limits) -> dict[str, Any]:
    """Return limits as the four fields of a message, with null for no limit, or for a range without one of its ends."""
    ranges = [tuple(pair) if np.isfinite(pair).all() else None for pair in limits.positions.tolist()]
    largest = {name: finite_or_null(getattr(limits, name)) for name in ("velocities", "accelerations", "jerks")}
    return {"positions": ranges, **largest}


def limits_of(limits: m.RobotLimits) -> Limits:
    """Return the limits of a robot's description message, with ±inf for null."""
    ranges = [(-np.inf, np.inf) if pair is None else pair for pair in limits.positions]
    largest = (
        np.array([np.inf if value is None else value for value in values])
        for values in (limits.velocities, limits.accelerations, limits.jerks)
    )
    return Limits(np.array(ranges, dtype=float), *largest)


def unit_of(quantity: str, slides: bool) -> str:
    """Return the unit of a joint's position, velocity, acceleration or jerk."""
    return in_metres(UNITS[quantity]) if slides else UNITS[quantity]


def in_metres(sentence: str) -> str:
    """Return a sentence about a hinge as one about a slide: in m and N."""
    return _OF_A_HINGE.sub(lambda found: {"rad": "m", "N·m": "N"}[found[0]], sentence)


_OF_A_HINGE = re.compile(r"\brad\b|N·m")


def collision_refusal(error: Collides) -> Refusal:
    """Return the refusal `collision` for a motion that collides."""
    where = {"body": error.body, "other": error.other, "time_from_start": error.time}
    return Refusal("collision", str(error), **where, distance=error.distance)
