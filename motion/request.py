"""What a motion is asked to do: start, goal, duration, way-points, limits."""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from motion.basis import INTERVALS
from motion.errors import InvalidMotion
from motion.limits import Limits

MIN_SEPARATION = 0.01
"""Way-points closer than this part of the duration to each other or to an end are refused (design 1.1)."""


@dataclass(frozen=True, slots=True, eq=False)
class Boundary:
    """State of J joints at an end of the motion: (J,) rad, rad/s, rad/s²; a NaN acceleration is free."""

    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray

    def __post_init__(self) -> None:
        for name in ("positions", "velocities", "accelerations"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))


@dataclass(frozen=True, slots=True, eq=False)
class Waypoint:
    """A state to pass exactly at `time_from_start` (s): (J,) rad and rad/s; NaN entries are free."""

    time_from_start: float
    positions: np.ndarray
    velocities: np.ndarray

    def __post_init__(self) -> None:
        for name in ("positions", "velocities"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))


@dataclass(frozen=True, slots=True, eq=False)
class MotionRequest:
    """A motion of J joints from `start` to `goal` in `duration` seconds inside `limits`.

    A NaN acceleration of the goal is free where the final velocity is not 0 and zero where it is (design 1.9):
    `final_accelerations` (J,) are those at the end of the moving part, NaN where they stay free. `rest_fraction` is
    the final part of the duration with exactly zero acceleration (rounded up to 0.001). `tail` "stop" ends in a
    jerk-limited stop after the hit, "coast" moves on at the final velocity (the paper's way). Raises InvalidMotion
    naming the field for anything malformed.
    """

    start: Boundary
    goal: Boundary
    duration: float
    limits: Limits
    waypoints: tuple[Waypoint, ...] = ()
    rest_fraction: float = 0.0
    tail: Literal["stop", "coast"] = "stop"
    final_accelerations: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        joints = len(self.limits.velocities)
        for name, boundary in (("start", self.start), ("goal", self.goal)):
            _check_vector(f"{name}.positions", boundary.positions, joints)
            _check_vector(f"{name}.velocities", boundary.velocities, joints)
            _check_vector(f"{name}.accelerations", boundary.accelerations, joints, nan="free")
        if not (np.isfinite(self.duration) and self.duration > 0):
            raise InvalidMotion("duration", f"is {self.duration}; it has to be finite and greater than 0 s")
        if not (0 <= self.rest_fraction < 1 and self.moving_fraction >= MIN_SEPARATION):
            raise InvalidMotion(
                "rest_fraction", f"is {self.rest_fraction}; it has to be from 0 to {1 - MIN_SEPARATION}"
            )
        if self.rest_fraction > 0 and np.any(np.nan_to_num(self.goal.accelerations) != 0):
            raise InvalidMotion("goal.accelerations", "has to be null or 0 with a rest_fraction")
        if self.tail not in ("stop", "coast"):
            raise InvalidMotion("tail", f"is {self.tail!r}; it has to be 'stop' or 'coast'")
        self._check_waypoints(joints)
        at_rest = np.isnan(self.goal.accelerations) & (self.goal.velocities == 0)
        final = np.where(at_rest | (self.rest_fraction > 0), 0.0, self.goal.accelerations)
        object.__setattr__(self, "final_accelerations", final)

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return self.limits.joint_count

    @property
    def moving_fraction(self) -> float:
        """1−ρ, rounded down to the grid on which limits are looked at: where the moving part ends in s."""
        return math.floor((1 - self.rest_fraction) * INTERVALS + 1e-9) / INTERVALS

    @property
    def moving_duration(self) -> float:
        """Duration (s) without the final part of zero acceleration."""
        return self.moving_fraction * self.duration

    def _check_waypoints(self, joints: int) -> None:
        apart = MIN_SEPARATION * self.duration * (1 - 1e-9)
        times = [w.time_from_start for w in self.waypoints]
        for k, waypoint in enumerate(self.waypoints):
            field = f"waypoints[{k}]"
            _check_vector(f"{field}.positions", waypoint.positions, joints, nan="free")
            _check_vector(f"{field}.velocities", waypoint.velocities, joints, nan="free")
            time, end = times[k], self.moving_duration
            if not 0 < time < end:
                raise InvalidMotion(
                    f"{field}.time_from_start",
                    f"is {time:.6g} s; it has to lie between 0 and {end:.6g} s, where the motion is shaped",
                )
            others = [0.0, end, *times[:k], *times[k + 1 :]]
            if min(abs(time - other) for other in others) < apart:
                raise InvalidMotion(
                    f"{field}.time_from_start",
                    f"of {time:.6g} s is closer than {apart:.6g} s (0.01 of the duration) to another "
                    "way-point or to an end",
                )


def _check_vector(field: str, values: np.ndarray, joints: int, nan: str = "refused") -> None:
    if values.shape != (joints,):
        raise InvalidMotion(field, f"needs {joints} numbers, one a joint; it has shape {values.shape}")
    if not np.all(np.isfinite(values) | (np.isnan(values) if nan == "free" else False)):
        raise InvalidMotion(field, f"has to be finite; it is {values.tolist()}")
