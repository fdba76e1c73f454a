"""What disturbs the arm: pushes for a time, and noise on its sensors."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from protocol.errors import Refusal
from protocol.messages import ActiveDisturbance

MAX_PUSHES = 64
"""Pushes that act or wait."""

PushKind = Literal["acceleration", "torque"]


@dataclass(frozen=True, slots=True, eq=False)
class Push:
    """Acts on ticks first_tick <= tick < end_tick: values (J,) in rad/s² (`acceleration`) or N·m (`torque`)."""

    kind: PushKind
    values: np.ndarray
    first_tick: int
    end_tick: int


class Disturbances:
    """Pushes and noise of one run, kept by tick so that a run repeats exactly."""

    def __init__(self, joint_names: tuple[str, ...], rate_hz: float) -> None:
        self._joint_names = joint_names
        self._rate_hz = rate_hz
        self._pushes: list[Push] = []
        self.position_std = 0.0
        self.velocity_std = 0.0

    def clear(self) -> None:
        """No push and no noise."""
        self._pushes.clear()
        self.set_sensor_noise(0.0, 0.0)

    def set_sensor_noise(self, position_std: float, velocity_std: float) -> None:
        """Standard deviations (rad, rad/s) of what is measured, until told otherwise.

        Raises Refusal `bad_message` for a negative or non-finite one.
        """
        for field, value in (("position_std", position_std), ("velocity_std", velocity_std)):
            if not 0 <= value < math.inf:
                raise Refusal("bad_message", f"{field} is {value}; it has to be a finite number >= 0", field=field)
        self.position_std = position_std
        self.velocity_std = velocity_std

    def push(self, kind: PushKind, values: list[float], start: float | None, duration: float, tick: int) -> float:
        """Push with `values` (J,) for `duration` s from the first tick at or after `start` s (None: from `tick`, now).

        Returns the time it begins. Raises Refusal `bad_message` for a wrong length, a number that is not
        finite, or a start that is past; `busy` while MAX_PUSHES act or wait.
        """
        now = tick / self._rate_hz
        start = now if start is None else start
        self._check(values, start, duration, now)
        self._pushes = [push for push in self._pushes if push.end_tick > tick]
        if len(self._pushes) >= MAX_PUSHES:
            raise Refusal("busy", f"{MAX_PUSHES} disturbances act or wait already; wait for one to end", goal_id=None)
        first_tick = math.ceil(start * self._rate_hz - 1e-6)
        end_tick = first_tick + max(1, round(duration * self._rate_hz))
        self._pushes.append(Push(kind, np.array(values, dtype=float), first_tick, end_tick))
        return first_tick / self._rate_hz

    def acting(self, tick: int) -> list[Push]:
        """The pushes that act on `tick`."""
        return [push for push in self._pushes if push.first_tick <= tick < push.end_tick]

    def describe(self, tick: int) -> list[ActiveDisturbance]:
        """What disturbs the arm at `tick`, as published."""
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

    def _check(self, values: list[float], start: float, duration: float, now: float) -> None:
        joints = self._joint_names
        if len(values) != len(joints):
            message = f"values has {len(values)} numbers; the arm has {len(joints)} joints: {', '.join(joints)}"
            raise Refusal("bad_message", message, field="values")
        for name, value in zip(joints, values, strict=True):
            if not math.isfinite(value):
                raise Refusal("bad_message", f"values: {name} is {value}; it has to be finite", field="values")
        if not 0 < duration < math.inf:
            raise Refusal("bad_message", f"duration is {duration} s; it has to be finite and > 0", field="duration")
        if not now <= start < math.inf:
            message = f"start_time is {start} s, now is {now:.3f} s; name a later time, or null for now"
            raise Refusal("bad_message", message, field="start_time")
