"""Movements in closed form and their simulated recordings, for the benchmark of learning."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Curve = Callable[[np.ndarray], np.ndarray]

TWELVE_BITS = 2 * np.pi / 4096
"""Resolution of an encoder of 12 bit, rad."""


@dataclass(frozen=True, slots=True)
class Movement:
    """Positions, rad, and accelerations, rad/s², of one joint at times (n,), s."""

    name: str
    duration: float
    positions: Curve
    accelerations: Curve | None = None


@dataclass(frozen=True, slots=True)
class Recorder:
    """A simulated recording: samples a second, noise (rad), resolution (rad), jitter of the times.

    The jitter is a part of the time between samples; the movement is sampled at the jittered times.
    """

    rate: float
    noise: float = 0.0
    tick: float = 0.0
    jitter: float = 0.0

    def __str__(self) -> str:
        said = [f"noise {self.noise:g}"] * bool(self.noise) + [f"steps of {self.tick:.3g} rad"] * bool(self.tick)
        return ", ".join([*said, f"{self.rate:g} Hz"] + [f"{100 * self.jitter:g} % jitter"] * bool(self.jitter))

    def record(self, movement: Movement, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Return times and positions (n,)."""
        rng = np.random.default_rng(seed)
        times = np.arange(round(self.rate * movement.duration) + 1) / self.rate
        inside = slice(1, -1)
        times[inside] += rng.uniform(-self.jitter, self.jitter, len(times) - 2) / self.rate
        positions = movement.positions(times) + self.noise * rng.standard_normal(len(times))
        if self.tick:
            offset = rng.uniform(0, self.tick)
            positions = np.round((positions + offset) / self.tick) * self.tick - offset
        return times, positions


def _minimum_jerk(s: np.ndarray) -> np.ndarray:
    s = np.clip(s, 0, 1)
    return s**3 * (10 + s * (6 * s - 15))


def _pick_and_place(t: np.ndarray) -> np.ndarray:
    return sum((0.8 * (-1) ** move * _minimum_jerk((t - 0.5 - 3.2 * move) / 1.5) for move in range(6)), 0 * t)


def _handwriting(t: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(5)
    parts = zip(np.linspace(1, 4, 8), rng.uniform(0, 2 * np.pi, 8), rng.uniform(0.015, 0.05, 8), strict=True)
    return sum((size * np.sin(2 * np.pi * hz * t + phase) for hz, phase, size in parts), 0 * t)


STRIKE = Movement(
    "strike",
    1.0,
    lambda t: 2 * t**2 + np.cos(4 * np.pi * t) * (1 - t) - 1,
    lambda t: 4 - (4 * np.pi) ** 2 * np.cos(4 * np.pi * t) * (1 - t) + 8 * np.pi * np.sin(4 * np.pi * t),
)
"""The demonstration of the paper's figures."""

REACH = Movement("reach", 1.0, lambda t: 0.5 * _minimum_jerk(t), lambda t: 0.5 * (60 * t - 180 * t**2 + 120 * t**3))
STILL = Movement("joint held still", 1.0, lambda t: 0.3 + 0 * t, lambda t: 0 * t)
PICK_AND_PLACE = Movement("pick and place, 20 s", 20.0, _pick_and_place)
WIPING = Movement("wiping, 10 s at 2 Hz", 10.0, lambda t: 0.05 * np.sin(4 * np.pi * t))
HANDWRITING = Movement("handwriting, 10 s", 10.0, _handwriting)
SLOW = Movement("slow reach, 5 s", 5.0, lambda t: 0.4 * np.sin(0.9 * t) + 0.1 * np.sin(3 * t))
