"""Movements in closed form, and simulated recordings of them; all functions map times (n,), s, to positions, rad."""

from collections.abc import Callable

import numpy as np

Curve = Callable[[np.ndarray], np.ndarray]


def strike(t: np.ndarray) -> np.ndarray:
    """The demonstration of the paper's figures, 1 s."""
    return 2 * t**2 + np.cos(4 * np.pi * t) * (1 - t) - 1


def strike_acceleration(t: np.ndarray) -> np.ndarray:
    """Second derivative of `strike`, rad/s²; 66 rms."""
    return 4 - (4 * np.pi) ** 2 * np.cos(4 * np.pi * t) * (1 - t) + 8 * np.pi * np.sin(4 * np.pi * t)


def minimum_jerk(s: np.ndarray) -> np.ndarray:
    """Minimum-jerk profile: rises from 0 to 1 with s, at rest outside [0, 1]."""
    s = np.clip(s, 0, 1)
    return s**3 * (10 + s * (6 * s - 15))


def pick_and_place(t: np.ndarray) -> np.ndarray:
    """Six moves of 1.5 s and 0.8 rad in 20 s, with rests in between."""
    return sum(0.8 * (-1) ** move * minimum_jerk((t - 0.5 - 3.2 * move) / 1.5) for move in range(6)) + 0 * t


def wiping(t: np.ndarray) -> np.ndarray:
    """A sine of ±0.05 rad at 2 Hz."""
    return 0.05 * np.sin(4 * np.pi * t)


def handwriting(t: np.ndarray) -> np.ndarray:
    """A sum of eight sines of 1 to 4 Hz, 0.4 rad peak to peak."""
    rng = np.random.default_rng(5)
    parts = zip(np.linspace(1, 4, 8), rng.uniform(0, 2 * np.pi, 8), rng.uniform(0.015, 0.05, 8), strict=True)
    return sum((size * np.sin(2 * np.pi * hz * t + phase) for hz, phase, size in parts), 0 * t)


def stamped(duration: float, rate: float, jitter: float = 0.0, seed: int = 0) -> np.ndarray:
    """Return sample times (n,), s, each with an error of up to ±`jitter` sample periods."""
    times = np.arange(round(duration * rate) + 1) / rate
    return times + np.random.default_rng(seed).uniform(-jitter, jitter, len(times)) / rate


def rounded(values: np.ndarray, tick: float) -> np.ndarray:
    """Return positions quantised by an encoder with a resolution of `tick`, rad."""
    return np.round(values / tick) * tick
