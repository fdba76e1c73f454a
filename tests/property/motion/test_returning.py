"""An arm that was pushed off its reference returns inside the limits, from any state."""

import numpy as np
import pytest

from motion.limits import Limits
from motion.tracking import returning_acceleration

TICK = 1e-3


def limits_of(rng: np.random.Generator) -> Limits:
    """Return limits of four joints, from slow (10 rad/s²) to fast (500 rad/s²); one joint has no position limits."""
    velocities, accelerations = rng.uniform(2.0, 20.0, 4), 10.0 ** rng.uniform(1.0, 2.7, 4)
    ranges = np.stack([-rng.uniform(1.0, 3.0, 4), rng.uniform(1.0, 3.0, 4)], axis=1)
    ranges[3] = -np.inf, np.inf
    return Limits(ranges, velocities, accelerations, accelerations * 50)


def reference_at(time: float, swing: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities of a reference that swings for a second and then rests."""
    phase = rate * min(time, 1.0)
    fade = 1.0 if time < 1.0 else 0.0
    return swing * np.sin(phase), fade * swing * rate * np.cos(phase)


@pytest.mark.parametrize("seed", range(6))
def test_the_way_back_keeps_the_limits(seed: int):
    """Accelerations keep their limits always; velocities and positions wherever there was room to brake."""
    rng = np.random.default_rng(seed)
    limits, alpha = limits_of(rng), float(rng.choice([20.0, 50.0, 100.0]))
    swing = np.full(4, 0.3)
    rate = 0.5 * np.minimum(np.sqrt(limits.accelerations / swing), limits.velocities / swing)
    positions, velocities = reference_at(0.0, swing, rate)
    positions = positions + rng.uniform(-0.5, 0.5, 4)
    thrown = np.minimum(1.5 * limits.velocities, np.sqrt(2.0 * limits.accelerations))  # it can stop within a radian
    velocities = velocities + rng.uniform(-1.0, 1.0, 4) * thrown
    room = np.where(velocities > 0, limits.positions[:, 1] - positions, positions - limits.positions[:, 0])
    can_stop = velocities**2 / (2 * limits.accelerations) < room - 2e-3
    fastest = np.maximum(limits.velocities, np.abs(velocities))
    for tick in range(3000):
        here, ahead = (reference_at(t * TICK, swing, rate) for t in (tick, tick + 1))
        target = (*here, (ahead[1] - here[1]) / TICK)
        accelerations = returning_acceleration(alpha, target, positions, velocities, limits, TICK)
        assert np.all(np.abs(accelerations) <= limits.accelerations)
        positions = positions + TICK * (velocities + TICK / 2 * accelerations)
        velocities = velocities + TICK * accelerations
        assert np.all(np.abs(velocities) <= fastest + 1e-9)
        fastest = np.maximum(limits.velocities, np.abs(velocities))  # beyond its limit a joint only slows down
        outside = (positions < limits.positions[:, 0] - 1e-9) | (positions > limits.positions[:, 1] + 1e-9)
        assert not np.any(outside & can_stop)
    rest = swing * np.sin(rate)
    assert np.abs(positions - rest).max() < 1e-6
    assert np.abs(velocities).max() < 1e-5
