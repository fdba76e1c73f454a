"""Convert a primitive to and from the arrays of its file."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from motion.demonstration import Demonstration, SavitzkyGolay
from motion.errors import InvalidMotion
from motion.primitive import Primitive, learn

VECTORS = "position_rms", "position_max", "fit_rms", "noise_estimate"
"""Fields with one number a joint."""


def to_arrays(primitive: Primitive) -> dict[str, np.ndarray]:
    """Return all fields of a primitive as arrays, for `np.savez`."""
    arrays = {field.name: np.array(getattr(primitive, field.name)) for field in fields(primitive)}
    used = primitive.smoothing
    return arrays | {"smoothing": np.array([] if used is None else [used.window_s, used.order], dtype=float)}


def from_arrays(arrays: Mapping[str, np.ndarray]) -> Primitive:
    """Return the primitive of arrays from `to_arrays`, also of versions without spread or with Gaussian weights.

    Raises:
        InvalidMotion: an array is missing or malformed; its name is the error's field.
    """
    if is_gaussian(arrays):
        arrays = _converted(arrays)
    names = [field.name for field in fields(Primitive) if field.name != "spread"]
    data: dict[str, Any] = {name: _array(arrays, name) for name in names}
    filtered, points = data["smoothing"], data["control_points"]
    if points.ndim != 2 or not len(points):
        raise InvalidMotion("control_points", f"needs joints × control points; it has shape {points.shape}")
    joints = (len(points),)
    wanted = {"duration": ((),), "samples": ((),), "smoothing": ((0,), (2,)), **dict.fromkeys(VECTORS, (joints,))}
    for name, shapes in wanted.items():
        if data[name].shape not in shapes:
            raise InvalidMotion(name, f"has shape {data[name].shape}; it must be {' or '.join(map(str, shapes))}")
    data["smoothing"] = SavitzkyGolay(float(filtered[0]), int(filtered[1])) if filtered.size else None
    data["duration"], data["samples"] = float(data["duration"]), int(data["samples"])
    data["spread"] = _array(arrays, "spread") if "spread" in arrays else np.empty((*joints, 0))
    return Primitive(**data)


def is_gaussian(arrays: Mapping[str, np.ndarray]) -> bool:
    """Return whether `arrays` have the format of earlier versions, with accelerations as sums of Gaussians."""
    return "theta" in arrays and "control_points" not in arrays


def _converted(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the same primitive in the present format, learned from its smoothed positions at even times."""
    duration, positions = _array(arrays, "duration"), np.atleast_1d(_array(arrays, "positions"))
    if duration.shape != () or duration <= 0:
        raise InvalidMotion("duration", f"is {duration}; it must be greater than 0 s")
    learned = learn(Demonstration(np.linspace(0, duration, len(positions)), positions))
    kept = {name: arrays[name] for name in ("samples", "noise_estimate", "smoothing") if name in arrays}
    return to_arrays(learned) | kept


def _array(arrays: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    if name not in arrays:
        raise InvalidMotion(name, "is missing")
    values = np.array(arrays[name], dtype=float)
    if not np.isfinite(values).all():
        raise InvalidMotion(name, "must be finite")
    return values
