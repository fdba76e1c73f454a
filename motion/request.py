"""The request of a motion: start, goal, duration, waypoints, limits."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from motion.errors import InvalidMotion
from motion.limits import Limits

MIN_SEPARATION = 0.01
"""Least distance of waypoints to each other and to the ends, as a part of the duration."""


MIN_PLACE_TIME = 0.05
"""s; with a shorter place time accelerations would hardly count in the cost."""


@dataclass(frozen=True, slots=True, eq=False)
class Boundary:
    """State of J joints at an end of the motion: (J,) rad, rad/s, rad/s²; a NaN acceleration is free."""

    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray

    def __post_init__(self) -> None:
        for name in ("positions", "velocities", "accelerations"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))

    @property
    def state(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions, velocities and accelerations."""
        return self.positions, self.velocities, self.accelerations


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

    A NaN acceleration of the goal is free if the final velocity is not 0, and zero if it is. `final_accelerations` (J,)
    are those at the end of the moving part, NaN if free. rest_fraction: final part of the duration with exactly zero
    acceleration. tail: "stop" appends a jerk-limited stop after the hit, "coast" continues at the final velocity, as in
    the paper. follow_through: s for which the final velocity is kept after the hit, before the stop. place_time: time
    constant (s) within which the motion returns to the demonstrated positions after the start and before the goal; None
    spreads the difference over the whole motion, as in the paper. phase: where in the demonstration, 0 to 1, the motion
    begins; it imitates the rest. Raises InvalidMotion that names the malformed field.
    """

    start: Boundary
    goal: Boundary
    duration: float
    limits: Limits
    waypoints: tuple[Waypoint, ...] = ()
    rest_fraction: float = 0.0
    tail: Literal["stop", "coast"] = "stop"
    follow_through: float = 0.0
    place_time: float | None = None
    phase: float = 0.0
    final_accelerations: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        joints = len(self.limits.velocities)
        ends = (("start", self.start), ("goal", self.goal))
        given = {f"{end}.{name}": getattr(state, name) for end, state in ends for name in ("positions", "velocities")}
        _check_vectors(given, joints)
        _check_vectors({f"{end}.accelerations": state.accelerations for end, state in ends}, joints, free=True)
        place_time = MIN_PLACE_TIME if self.place_time is None else self.place_time
        for name, fits, wanted in (
            ("duration", 0 < self.duration < np.inf, "be finite and greater than 0 s"),
            ("rest_fraction", 0 <= self.rest_fraction <= 1 - MIN_SEPARATION, f"lie between 0 and {1 - MIN_SEPARATION}"),
            ("follow_through", 0 <= self.follow_through < np.inf, "be finite and at least 0 s"),
            ("place_time", MIN_PLACE_TIME <= place_time < np.inf, f"be finite and at least {MIN_PLACE_TIME} s"),
            ("phase", 0 <= self.phase < 1, "be at least 0 and less than 1"),
        ):
            if not fits:
                raise InvalidMotion(name, f"is {getattr(self, name)}; it must {wanted}")
        if self.tail not in ("stop", "coast"):
            raise InvalidMotion("tail", f"is {self.tail!r}; it must be 'stop' or 'coast'")
        if self.follow_through > 0 and self.tail == "coast":
            raise InvalidMotion("follow_through", "needs the tail 'stop': a motion that coasts does not end")
        straight = self.rest_fraction > 0 or self.follow_through > 0
        if straight and np.any(np.nan_to_num(self.goal.accelerations) != 0):
            raise InvalidMotion("goal.accelerations", "must be null or 0 with a rest_fraction or a follow_through")
        self._check_waypoints(joints)
        at_rest = np.isnan(self.goal.accelerations) & (self.goal.velocities == 0)
        final = np.where(at_rest | straight, 0.0, self.goal.accelerations)
        object.__setattr__(self, "final_accelerations", final)

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return self.limits.joint_count

    @property
    def waypoint_times(self) -> list[float]:
        """Times of the waypoints, s from the start."""
        return [float(waypoint.time_from_start) for waypoint in self.waypoints]

    @property
    def moving_duration(self) -> float:
        """Duration (s) without the final part of zero acceleration."""
        return (1 - self.rest_fraction) * self.duration

    @property
    def straight_duration(self) -> float:
        """Time (s) of constant velocity after the moving part: before the hit and after it."""
        return self.rest_fraction * self.duration + self.follow_through

    @property
    def stops_at(self) -> np.ndarray:
        """Positions (J,) at which the stop begins: the goal, or the end of the follow-through."""
        return self.goal.positions + self.follow_through * self.goal.velocities

    @property
    def imitates(self) -> tuple[float, float]:
        """Phases of the demonstration at which the imitated part begins and ends."""
        return self.phase, self.phase + (1 - self.phase) * (1 - self.rest_fraction)

    def clipped(self) -> "MotionRequest":
        """The same request, with values of goal and waypoints that exceed a limit by rounding set to the limit."""
        clip = self.limits.clipped
        goal = replace(self.goal, positions=clip(0, self.goal.positions), velocities=clip(1, self.goal.velocities))
        waypoints = tuple(
            replace(w, positions=clip(0, w.positions), velocities=clip(1, w.velocities)) for w in self.waypoints
        )
        return replace(self, goal=goal, waypoints=waypoints)

    def stretched(self, duration: float) -> "MotionRequest":
        """The same request with another duration (s); the times of its waypoints scale with it."""
        factor = duration / self.duration
        waypoints = tuple(replace(w, time_from_start=w.time_from_start * factor) for w in self.waypoints)
        return replace(self, duration=duration, waypoints=waypoints)

    def _check_waypoints(self, joints: int) -> None:
        if not self.waypoints:
            return
        each = list(enumerate(self.waypoints))
        given = {f"waypoints[{k}].{name}": getattr(w, name) for k, w in each for name in ("positions", "velocities")}
        _check_vectors(given, joints, free=True)
        times, end = np.array(self.waypoint_times), self.moving_duration
        if (outside := ~((times > 0) & (times < end))).any():
            wanted = f"it must lie after 0 and before {end:.6g} s, where the motion is shaped"
            raise _invalid_time(times, outside, f"; {wanted}")
        order, apart = np.argsort(times), MIN_SEPARATION * self.duration
        close = np.diff(times[order], prepend=0.0, append=end) < apart * (1 - 1e-9)
        if close.any():
            near = f"closer than {apart:.6g} s (0.01 of the duration) to another waypoint or to an end"
            raise _invalid_time(times, (close[1:] | close[:-1])[np.argsort(order)], f", {near}")


def _invalid_time(times: np.ndarray, wrong: np.ndarray, why: str) -> InvalidMotion:
    """The error of the first waypoint whose time is `wrong` (n,)."""
    k = int(wrong.argmax())
    return InvalidMotion(f"waypoints[{k}].time_from_start", f"is {times[k]:.6g} s{why}")


def _check_vectors(given: dict[str, np.ndarray], joints: int, free: bool = False) -> None:
    """Raise InvalidMotion for the first field that is not (J,) finite numbers. free: NaN is allowed."""
    for name, values in given.items():
        if values.shape != (joints,):
            raise InvalidMotion(name, f"needs {joints} numbers, one a joint; it has shape {values.shape}")
    vectors = np.array(list(given.values()))
    wrong = np.isinf(vectors) if free else ~np.isfinite(vectors)
    if wrong.any():
        row, joint = np.argwhere(wrong)[0].tolist()
        raise InvalidMotion([*given][row], f"is {vectors[row, joint]} for joint {joint}; it must be finite")
