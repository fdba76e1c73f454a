"""Disturbances of the arm: pushes, sensor noise, message loss."""

import math
from dataclasses import dataclass

import numpy as np

from motion.listing import listed
from protocol.codec import bad_message
from protocol.errors import Refusal
from protocol.messages import ActiveDisturbance, Disturb
from robot.conversions import in_metres
from robot.description import RobotConfig

FIELDS = {
    "acceleration": ("values", "start_time", "duration"),
    "torque": ("values", "start_time", "duration"),
    "sensor_noise": ("position_std", "velocity_std"),
    "ball_noise": ("position_std", "latency_s", "drop_rate"),
    "wind": ("values",),
    "loss": ("stream", "duration"),
}
"""Fields of each kind of disturbance; all others must be null."""

UNITS = {"acceleration": "rad/s²", "torque": "N·m"}
"""Unit of a push by kind, on a hinge."""

MAX_PUSHES = 64
"""Largest number of active and pending pushes."""

MAX_PUSH = 10.0
"""Largest push, in units of a joint's acceleration or torque limit; far beyond it the physics diverges."""

UNLIMITED_PUSH = 1e4
"""Largest push on a joint without such a limit, rad/s² or N·m."""

MAX_NOISE = 10.0
"""Largest standard deviation of sensor noise, rad or rad/s."""

MAX_SPAN_S = 3600.0
"""Longest time from now to a push, and longest duration of a push or a loss."""


@dataclass(frozen=True, slots=True, eq=False)
class Push:
    """Acts on ticks first_tick <= tick < end_tick: values (J,) in rad/s² (`acceleration`) or N·m (`torque`)."""

    kind: str
    values: np.ndarray
    first_tick: int
    end_tick: int


def check_fields(request: Disturb) -> None:
    """Raise Refusal `bad_message` for a field of `request` that belongs to another kind."""
    for name in request.__struct_fields__:
        if name not in ("version", "kind", *FIELDS[request.kind]) and getattr(request, name) is not None:
            raise bad_message(name, f"{name} belongs to another kind; leave it null in {request.kind!r}")


class Disturbances:
    """Pushes and noise of one run, stored by tick so that a run is repeatable."""

    def __init__(self, config: RobotConfig) -> None:
        self._joint_names, self._slides = config.joint_names, config.slides
        self._rate_hz = config.rate_hz
        limits = {"acceleration": config.limits.accelerations, "torque": config.torques}
        self._largest = {
            kind: np.where(np.isfinite(limit), MAX_PUSH * limit, UNLIMITED_PUSH) for kind, limit in limits.items()
        }
        self._pushes: list[Push] = []
        self.position_std = 0.0
        self.velocity_std = 0.0

    def clear(self) -> None:
        """Remove all pushes and noise."""
        self._pushes.clear()
        self.set_sensor_noise(0.0, 0.0)

    def set_sensor_noise(self, position_std: float, velocity_std: float) -> None:
        """Set the standard deviations (rad, rad/s) of the measurements, until the next such request.

        Raises Refusal `bad_message` for a value that is negative or too large.
        """
        for field, value, unit in (("position_std", position_std, "rad"), ("velocity_std", velocity_std, "rad/s")):
            if not 0 <= value <= MAX_NOISE:
                raise bad_message(field, f"{field} is {value} {unit}; it must lie between 0 and {MAX_NOISE} {unit}")
        self.position_std = position_std
        self.velocity_std = velocity_std

    def push(self, request: Disturb, tick: int) -> float:
        """Push as requested, from the first tick at or after its `start_time` (None: from `tick`, now).

        Returns its start time. Raises Refusal: `bad_message` for a missing field, a wrong length, a number that is too
        large, or a start in the past or too far ahead; `busy` while MAX_PUSHES are active or pending.
        """
        now, values, duration = tick / self._rate_hz, request.values, request.duration
        if values is None or duration is None:
            field = "values" if values is None else "duration"
            raise bad_message(field, f"{field} is missing; kind {request.kind!r} needs it")
        start = now if request.start_time is None else request.start_time
        self._check_values(request.kind, values)
        self._check_times(start, duration, now)
        self._pushes = [push for push in self._pushes if push.end_tick > tick]
        if len(self._pushes) >= MAX_PUSHES:
            raise Refusal("busy", f"{MAX_PUSHES} disturbances act or wait already; wait for one to end", goal_id=None)
        first_tick = math.ceil(start * self._rate_hz - 1e-6)
        end_tick = first_tick + max(1, round(duration * self._rate_hz))
        self._pushes.append(Push(request.kind, np.array(values, dtype=float), first_tick, end_tick))
        return first_tick / self._rate_hz

    def acting(self, tick: int) -> list[Push]:
        """Return the pushes that are active at `tick`."""
        return [push for push in self._pushes if push.first_tick <= tick < push.end_tick]

    def describe(self, tick: int) -> list[ActiveDisturbance]:
        """Return the disturbances that are active at `tick`, as published."""
        active = [
            ActiveDisturbance(kind=push.kind, values=push.values.tolist(), end_time=push.end_tick / self._rate_hz)
            for push in self.acting(tick)
        ]
        if self.position_std or self.velocity_std:
            noise = ActiveDisturbance(
                kind="sensor_noise", position_std=self.position_std, velocity_std=self.velocity_std
            )
            active.append(noise)
        return active

    def _check_values(self, kind: str, values: list[float]) -> None:
        joints = self._joint_names
        if len(values) != len(joints):
            sentence = f"values has {len(values)} numbers; the arm has {len(joints)} joints: {listed(joints)}"
            raise bad_message("values", sentence)
        for name, slides, value, bound in zip(joints, self._slides, values, self._largest[kind], strict=True):
            if not abs(value) <= bound:
                unit = in_metres(UNITS[kind]) if slides else UNITS[kind]
                sentence = f"values: {name} is {value:g} {unit}; it must lie between {-bound:g} and {bound:g} {unit}"
                raise bad_message("values", sentence)

    def _check_times(self, start: float, duration: float, now: float) -> None:
        if not 0 < duration <= MAX_SPAN_S:
            sentence = f"duration is {duration} s; it must be greater than 0 and at most {MAX_SPAN_S} s"
            raise bad_message("duration", sentence)
        if not now <= start <= now + MAX_SPAN_S:
            sentence = f"start_time is {start} s, now is {now:.3f} s; name one of the next {MAX_SPAN_S:g} s, or null"
            raise bad_message("start_time", sentence)


class Loss:
    """Windows of ticks in which the messages of a stream are dropped."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._windows: dict[str, tuple[int, int]] = {}

    def begin(self, request: Disturb, tick: int) -> None:
        """Drop the messages of the stream in `request`, from `tick` on, for its duration.

        Raises:
            Refusal: `bad_message` for fields that are missing, of another kind, or out of range.
        """
        check_fields(request)
        if request.stream is None:
            raise bad_message("stream", "stream is missing; say whether 'state' or 'command' messages are lost")
        if request.duration is None or not 0 < request.duration <= MAX_SPAN_S:
            raise bad_message("duration", f"duration is {request.duration}; a loss lasts 0 to {MAX_SPAN_S:g} s")
        self._windows[request.stream] = tick, tick + math.ceil(request.duration * self._rate_hz - 1e-9)

    def clear(self) -> None:
        """End all losses."""
        self._windows.clear()

    def has(self, stream: str, tick: int) -> bool:
        """Return whether the message of `tick` on `stream` is dropped."""
        first, end = self._windows.get(stream, (0, 0))
        return first <= tick < end

    def describe(self, tick: int) -> list[ActiveDisturbance]:
        """Return the losses that are active at `tick`, as published."""
        return [
            ActiveDisturbance(kind="loss", stream=stream, end_time=end / self._rate_hz)
            for stream, (first, end) in self._windows.items()
            if first <= tick < end
        ]
