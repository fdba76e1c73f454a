import numpy as np
import pytest

from motion.demonstration import Demonstration, SavitzkyGolay, estimate_noise, smooth
from motion.errors import InvalidMotion

TIMES = np.linspace(0, 1, 1001)
POSITIONS = 2 * TIMES**2 + np.cos(4 * np.pi * TIMES) * (1 - TIMES) - 1
ACCELERATIONS = 4 - 16 * np.pi**2 * np.cos(4 * np.pi * TIMES) * (1 - TIMES) + 8 * np.pi * np.sin(4 * np.pi * TIMES)


def error(noise: float, smoothing: object, seed: int = 0) -> float:
    """Relative rms error of the accelerations of the figures' demonstration with uniform noise."""
    noisy = POSITIONS + np.random.default_rng(seed).uniform(-noise, noise, len(TIMES))
    found = smooth(Demonstration(TIMES, noisy[:, None]), smoothing).accelerations[:, 0]  # type: ignore[arg-type]
    return float(np.sqrt(np.mean((found - ACCELERATIONS) ** 2) / np.mean(ACCELERATIONS**2)))


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3, 1e-2])
def test_auto_comes_near_the_best_window(noise: float) -> None:
    windows = np.arange(0.02, 0.35, 0.02)
    best = min(error(noise, SavitzkyGolay(w, 5)) for w in windows)
    assert error(noise, "auto") < 4 * best + 1e-4


def test_noise_without_smoothing_ruins_accelerations() -> None:
    assert error(1e-2, "none") > 100
    assert error(0.0, "none") < 1e-4


@pytest.mark.parametrize("rms", [1e-5, 1e-3])
def test_noise_is_estimated(rms: float) -> None:
    noisy = POSITIONS + np.random.default_rng(3).normal(scale=rms, size=len(TIMES))
    assert estimate_noise(noisy[:, None])[0] == pytest.approx(rms, rel=0.2)
    assert estimate_noise(POSITIONS[:, None])[0] < 1e-9


def test_window_is_in_seconds() -> None:
    """The same recording at half the speed needs twice the window to be smoothed alike."""
    noisy = POSITIONS + np.random.default_rng(0).uniform(-1e-3, 1e-3, len(TIMES))
    one = smooth(Demonstration(TIMES, noisy[:, None]), SavitzkyGolay(0.1, 5))
    two = smooth(Demonstration(2 * TIMES, noisy[:, None]), SavitzkyGolay(0.2, 5))
    assert np.allclose(one.positions, two.positions, atol=1e-12)
    assert np.allclose(one.accelerations, 4 * two.accelerations, rtol=1e-9, atol=1e-6)
    assert one.smoothing is not None
    assert one.smoothing.window_s == pytest.approx(0.101)


def test_uneven_times_are_resampled() -> None:
    uneven = TIMES + 0.0004 * np.sin(40 * TIMES) * TIMES * (1 - TIMES)
    positions = np.interp(uneven, TIMES, POSITIONS)[:, None]
    smoothed = smooth(Demonstration(5 + uneven, positions), "auto")
    assert smoothed.times[0] == 0
    assert np.ptp(np.diff(smoothed.times)) < 1e-12
    assert np.abs(smoothed.positions[:, 0] - POSITIONS).max() < 1e-4


@pytest.mark.parametrize(
    ("times", "positions", "field"),
    [
        (TIMES, POSITIONS, "positions"),
        (TIMES[:5], POSITIONS[:5, None], "positions"),
        (TIMES[:-1], POSITIONS[:, None], "times"),
        (TIMES[::-1], POSITIONS[:, None], "times"),
        (np.where(TIMES == 0.5, np.nan, TIMES), POSITIONS[:, None], "times"),
        (TIMES, np.where(TIMES == 0.5, np.inf, POSITIONS)[:, None], "positions"),
        (TIMES, POSITIONS[:, None][:, :0], "positions"),
    ],
)
def test_malformed_demonstrations_are_refused(times: np.ndarray, positions: np.ndarray, field: str) -> None:
    with pytest.raises(InvalidMotion) as refusal:
        Demonstration(times, positions)
    assert refusal.value.field == field
    assert isinstance(refusal.value, ValueError)


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
def test_windows_that_do_not_fit_are_refused(smoothing: SavitzkyGolay, words: str) -> None:
    with pytest.raises(InvalidMotion, match=words):
        smooth(Demonstration(TIMES, POSITIONS[:, None]), smoothing)
