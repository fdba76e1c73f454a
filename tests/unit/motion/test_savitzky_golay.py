"""The Savitzky-Golay filter of the paper, and the spline fitted to its output."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

from motion import splines
from motion.demonstration import Demonstration, SavitzkyGolay
from motion.errors import InvalidMotion
from motion.primitive import learn
from motion.savitzky_golay import filtered, follow
from tests.unit.motion.recordings import strike, strike_acceleration

TIMES = np.linspace(0, 1, 1001)
POSITIONS = strike(TIMES)


def test_window_is_in_seconds() -> None:
    """The same recording at half the speed needs twice the window for the same result."""
    noisy = POSITIONS + np.random.default_rng(0).uniform(-1e-3, 1e-3, len(TIMES))
    used, places, accelerations = filtered(Demonstration(TIMES, noisy[:, None]), SavitzkyGolay(0.1, 5))
    _, slow_places, slow_accelerations = filtered(Demonstration(2 * TIMES, noisy[:, None]), SavitzkyGolay(0.2, 5))
    assert np.allclose(places, slow_places, atol=1e-12)
    assert np.allclose(accelerations, 4 * slow_accelerations, rtol=1e-9, atol=1e-6)
    assert used.window_s == pytest.approx(0.101)


def test_uneven_times_are_resampled() -> None:
    uneven = TIMES + 0.0004 * np.sin(40 * TIMES) * TIMES * (1 - TIMES)
    _, places, accelerations = filtered(Demonstration(5 + uneven, strike(uneven)[:, None]), SavitzkyGolay(0.03, 5))
    assert np.abs(places[:, 0] - POSITIONS).max() < 1e-4
    assert np.abs(accelerations[:, 0] - strike_acceleration(TIMES)).max() < 2


def test_times_too_close_for_the_filter_are_refused_with_their_samples() -> None:
    times = np.sort(np.append(TIMES, TIMES[100] + 1e-9))
    with pytest.raises(InvalidMotion, match="samples 100 and 101 are 1e-09 s apart"):
        filtered(Demonstration(times, times[:, None]), SavitzkyGolay(0.1, 5))


@pytest.mark.parametrize("window", [0.02, 0.05, 0.1])
@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_the_splines_accelerations_are_the_filters(window: float, noise: float) -> None:
    """Within 10 % of the error of a spline fitted to the accelerations alone."""
    noisy = POSITIONS + noise * np.random.default_rng(0).standard_normal(len(TIMES))
    wanted = np.asarray(savgol_filter(noisy, round(window * 1000) | 1, 5, deriv=2, delta=1e-3))
    primitive = learn(Demonstration(TIMES, noisy[:, None]), SavitzkyGolay(window, 5))
    rows = splines.rows(primitive.basis_count, 3, TIMES)
    nearest = rows @ np.linalg.lstsq(rows, wanted, rcond=None)[0]
    best = np.sqrt(np.mean((nearest - wanted) ** 2))
    assert primitive.fit_rms[0] < 1.1 * best + 1e-4 * np.sqrt(np.mean(wanted**2))
    assert primitive.position_max[0] < 0.002


def test_positions_do_not_drift() -> None:
    """The spline of 60 s of filtered accelerations stays within 5 mrad of the demonstration."""
    times = np.linspace(0, 60, 6001)
    shown = 0.5 * np.sin(times)[:, None]
    noisy = shown + 1e-3 * np.random.default_rng(0).standard_normal(shown.shape)
    _, places, accelerations = filtered(Demonstration(times, noisy), SavitzkyGolay(0.2, 3))
    points = follow(places, accelerations, 60.0, 140)
    assert np.abs(splines.derivative(points, times / 60, 0) - shown).max() < 0.005


@pytest.mark.parametrize(
    ("smoothing", "words"),
    [
        (SavitzkyGolay(2.0, 5), "longer than the demonstration"),
        (SavitzkyGolay(0.003, 5), "0.007 s or more works"),
        (SavitzkyGolay(-1.0, 5), "greater than 0"),
        (SavitzkyGolay(np.nan, 5), "greater than 0"),
        (SavitzkyGolay(0.1, 1), "at least 2"),
    ],
)
def test_invalid_windows_and_degrees_are_refused(smoothing: SavitzkyGolay, words: str) -> None:
    with pytest.raises(InvalidMotion, match=words):
        learn(Demonstration(TIMES, POSITIONS[:, None]), smoothing)
