"""The camera that measures the ball, with noise, latency and losses."""

import math
from collections import deque
from typing import Any

import numpy as np

from protocol.codec import bad_message
from protocol.messages import ActiveDisturbance, BallState, BallTruth, Disturb

BOUNDS = {"position_std": 1.0, "latency_s": 1.0, "drop_rate": 1.0}
"""Largest values of the fields of `ball_noise`: m, s, 1."""


class Camera:
    """Measurements of the ball, one every few ticks. Equal seeds and calls give equal measurements."""

    def __init__(self, rate_hz: float, every: int) -> None:
        """`rate_hz`: rate of the robot's ticks; `every`: ticks from one measurement to the next."""
        self._rate_hz = rate_hz
        self._every = every
        self._waiting: deque[tuple[int, BallState]] = deque()
        self.clear(0)

    def clear(self, seed: int | None = None) -> None:
        """Measure without noise, latency and losses, and drop pending measurements; with a seed, restart the noise."""
        self._noise = {"position_std": 0.0, "latency_s": 0.0, "drop_rate": 0.0}
        self._waiting.clear()
        if seed is not None:
            self._random = np.random.default_rng([seed, 1])

    def disturb(self, request: Disturb) -> None:
        """Set noise, latency and losses to those of `request`; null counts as 0.

        Raises:
            Refusal: `bad_message` for a field that is out of range.
        """
        noise = {name: getattr(request, name) or 0.0 for name in BOUNDS}
        for name, value in noise.items():
            if not 0 <= value <= BOUNDS[name]:
                raise bad_message(name, f"{name} is {value}; it must lie in 0 to {BOUNDS[name]:g}")
        self._noise = noise

    def describe(self) -> list[ActiveDisturbance]:
        """Return the noise as published."""
        noise: dict[str, Any] = self._noise
        return [ActiveDisturbance(kind="ball_noise", **noise)] if any(noise.values()) else []

    def sees(self, tick: int) -> bool:
        """Return whether the camera measures at `tick`."""
        return tick % self._every == 0

    def see(self, tick: int, truth: BallTruth) -> None:
        """Measure the ball at `tick`."""
        noise, offsets = self._noise, self._random.standard_normal(3)
        if self._random.random() < noise["drop_rate"]:
            return
        position = (np.array(truth.position) + noise["position_std"] * offsets).tolist()
        velocity = None if any(noise.values()) else truth.velocity
        sight = BallState(time=tick / self._rate_hz, position=position, velocity=velocity, truth=truth)
        self._waiting.append((tick + math.ceil(noise["latency_s"] * self._rate_hz - 1e-9), sight))

    def take(self, tick: int) -> list[BallState]:
        """Return the measurements that have arrived by `tick`, in order."""
        arrived = []
        while self._waiting and self._waiting[0][0] <= tick:
            arrived.append(self._waiting.popleft()[1])
        return arrived
