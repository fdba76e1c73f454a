"""Splines fitted to samples: errors of their positions and accelerations for various recorders."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

from motion import splines
from motion.smoothing import Fit, fit, interpolate
from tests.unit.motion.recordings import (
    Curve,
    handwriting,
    minimum_jerk,
    pick_and_place,
    rounded,
    stamped,
    strike,
    strike_acceleration,
    wiping,
)

TWELVE_BITS = 2 * np.pi / 4096


def learned(times: np.ndarray, positions: np.ndarray, basis_count: int | None = None) -> Fit:
    """Fit one joint's samples: times (n,), s, and positions (n,), rad."""
    duration = times[-1] - times[0]
    return fit((times - times[0]) / duration, positions[:, None], duration, basis_count)


def positions_of(found: Fit, s: np.ndarray) -> np.ndarray:
    """Return positions of the first joint at phases (n,)."""
    return splines.derivative(found.control_points, s, 0)[:, 0]


def accelerations_of(found: Fit, s: np.ndarray, duration: float = 1.0) -> np.ndarray:
    """Return accelerations of the first joint at phases (n,), rad/s²."""
    return splines.derivative(found.control_points, s, 2)[:, 0] / duration**2


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(
    ("curve", "duration"),
    [(strike, 1.0), (pick_and_place, 20.0), (wiping, 10.0), (handwriting, 10.0)],
)
@pytest.mark.parametrize(
    ("rate", "noise", "tick"),
    [(500, 0, 0), (500, 1e-3, 0), (500, 0, 1e-3), (1000, 0, 1e-3), (200, 0, TWELVE_BITS), (1000, 0, TWELVE_BITS)],
)
def test_positions_are_within_1_percent_or_5_mrad(
    curve: Curve, duration: float, rate: float, noise: float, tick: float
) -> None:
    """With at most 400 functions, 50 for the strike of 1 s."""
    times = stamped(duration, rate)
    shown = curve(times)
    recorded = shown + noise * np.random.default_rng(1).standard_normal(len(times))
    found = learned(times, rounded(recorded, tick) if tick else recorded)
    assert np.abs(positions_of(found, times / duration) - shown).max() < max(0.01 * np.ptp(shown), 0.005)
    assert found.basis_count <= (50 if duration == 1 else 400)


def test_a_recording_of_60_s_is_fitted() -> None:
    times = stamped(60.0, 100)
    shown = 0.5 * np.sin(0.7 * times) + 0.2 * np.sin(2.3 * times)
    found = learned(times, shown)
    assert found.basis_count <= 140
    assert np.abs(positions_of(found, times / 60) - shown).max() < 5e-4


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3])
def test_the_noise_of_a_strike_is_estimated_and_50_functions_suffice(noise: float) -> None:
    times = stamped(1.0, 500)
    found = learned(times, strike(times) + noise * np.random.default_rng(0).standard_normal(len(times)))
    assert found.basis_count == 50
    assert found.noise[0] == pytest.approx(noise, rel=0.2, abs=1e-8)


def test_jitter_of_time_stamps_is_not_taken_for_noise() -> None:
    """Each sample is fitted at its own time."""
    times = stamped(1.0, 100, jitter=0.3)
    s = (times - times[0]) / (times[-1] - times[0])
    found = learned(times, strike(times))
    assert np.abs(positions_of(found, s) - strike(times)).max() < 1e-4


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("curve", "noise", "rate"), [(strike, 1e-3, 500), (strike, 1e-2, 1000), ("reach", 1e-3, 500)])
def test_acceleration_error_is_within_4_times_that_of_the_best_filter(
    curve: Curve | str, noise: float, rate: int, seed: int
) -> None:
    """The best Savitzky-Golay window is chosen with knowledge of the true accelerations."""
    times = stamped(1.0, rate)
    if isinstance(curve, str):
        shown, truth = 0.5 * minimum_jerk(times), 30 * times * (1 + times * (2 * times - 3))
    else:
        shown, truth = curve(times), strike_acceleration(times)
    recorded = shown + noise * np.random.default_rng(seed).standard_normal(len(times))
    windows = np.unique(np.geomspace(7, len(times) - 2, 30).astype(int) | 1)
    best = min(rms(savgol_filter(recorded, w, 5, deriv=2, delta=1 / rate) - truth) for w in windows.tolist())
    found = learned(times, recorded)
    assert rms(accelerations_of(found, times) - truth) < 4 * best
    assert rms(accelerations_of(found, times) - truth) < 0.1 * rms(truth)


def test_the_standard_error_estimates_the_acceleration_error() -> None:
    """The ratio of error to estimate is between 0.5 and 2, rms over ten recordings."""
    times = stamped(1.0, 500)
    ratios = []
    for seed in range(10):
        found = learned(times, strike(times) + 1e-3 * np.random.default_rng(seed).standard_normal(len(times)))
        ratios.append(rms(accelerations_of(found, times) - strike_acceleration(times)) / found.acceleration_error[0])
    assert 0.5 < rms(np.array(ratios)) < 2


@pytest.mark.parametrize("tick", [0.0, 1e-3])
def test_noise_of_a_joint_at_rest_is_smoothed_away(tick: float) -> None:
    """White noise, or an encoder that toggles by one tick; the other joint moves and is fitted closely."""
    times = stamped(2.0, 1000)
    if tick:
        still = np.where((times > 0.7) & (times < 0.705), 0.3 + tick, 0.3)
    else:
        still = 0.3 + 1e-2 * np.random.default_rng(0).standard_normal(len(times))
    moving = strike(times / 2) + 2e-4 * np.random.default_rng(1).standard_normal(len(times))
    found = fit(times / 2, np.stack([still, moving], axis=1), 2.0)
    s = np.linspace(0, 1, 1001)
    found_accelerations = splines.derivative(found.control_points, s, 2) / 4
    assert np.abs(found_accelerations[:, 0]).max() < 1e-3
    assert rms(found_accelerations[:, 1] - strike_acceleration(s) / 4) < 0.02 * rms(strike_acceleration(s) / 4)


def test_equal_samples_give_a_joint_at_rest() -> None:
    found = learned(stamped(1.0, 100), np.full(101, 0.7))
    s = np.linspace(0, 1, 101)
    assert np.abs(positions_of(found, s) - 0.7).max() < 1e-9
    assert np.abs(accelerations_of(found, s)).max() < 1e-6


def test_a_gap_in_the_samples_is_interpolated_smoothly() -> None:
    times = stamped(4.0, 500)
    shown = 0.5 * np.sin(2 * times)
    there = (times < 1.5) | (times > 2.0)
    recorded = shown + 1e-3 * np.random.default_rng(0).standard_normal(len(times))
    found = learned(times[there], recorded[there])
    assert np.abs(positions_of(found, times / 4) - shown).max() < 0.005


@pytest.mark.parametrize("samples", [10, 11, 23, 40])
def test_few_samples_suffice(samples: int) -> None:
    times = np.linspace(0, 1, samples)
    found = learned(times, minimum_jerk(times))
    assert 20 <= found.basis_count <= max(samples, 20)
    assert np.abs(positions_of(found, times) - minimum_jerk(times)).max() < 1e-3


def test_without_smoothing_the_samples_are_interpolated() -> None:
    """With 50 functions if they suffice, otherwise with up to 400."""
    times = stamped(1.0, 500)
    exact = interpolate(times, strike(times)[:, None], 1.0)
    assert exact.basis_count == 50
    assert np.abs(positions_of(exact, times) - strike(times)).max() < 1e-6
    rough = strike(times) + 1e-4 * np.random.default_rng(0).standard_normal(len(times))
    close = interpolate(times, rough[:, None], 1.0)
    assert close.basis_count == 400
    assert rms(positions_of(close, times) - rough) < 1e-4


def test_the_number_of_functions_can_be_chosen() -> None:
    times = stamped(1.0, 500)
    assert learned(times, strike(times), 30).basis_count == 30
