"""Several recordings of one movement: alignment in phase, mean and spread."""

from pathlib import Path

import numpy as np
import pytest

from tools.recordings.recording import Recording, Unreadable
from tools.recordings.several import combine


def shape(phase: np.ndarray) -> np.ndarray:
    return np.stack([0.5 * np.sin(7 * phase), 0.4 * phase + 0.2 * np.cos(5 * phase)], axis=1)


def warped(bend: float, duration: float = 2.0, noise: float = 0.0, columns: tuple[str, ...] = ("a", "b")) -> Recording:
    times = np.linspace(0, duration, 301)
    s = times / duration
    values = shape(s + bend * np.sin(np.pi * s) * s * (1 - s))
    values += noise * np.random.default_rng(1).standard_normal(values.shape)
    return Recording(times, columns, values, "rad", Path("swing.csv"), "swing", True)


def test_recordings_that_differ_only_in_phase_are_aligned() -> None:
    together = combine([warped(bend, 2.0 + bend) for bend in (-0.6, -0.2, 0.3, 0.5)])
    assert together.mean.times[-1] == pytest.approx(2.0, abs=0.01)
    apart = np.stack([warped(bend).values for bend in (-0.6, -0.2, 0.3, 0.5)]).std(axis=0, ddof=1)
    assert np.sqrt(np.mean(together.spread**2)) < 0.15 * np.sqrt(np.mean(apart**2))
    assert "4 recordings are learned together" in together.sentence()
    warps = together.warps
    assert (np.diff(warps, axis=1) > 0).all()
    assert np.abs(warps.mean(axis=0) - np.linspace(0, 1, warps.shape[1])).max() < 1e-6


def test_a_joint_that_hardly_moves_has_no_influence_on_the_alignment() -> None:
    """Its positions differ between recordings, with an amplitude of 0.01 rad beside the other joint's 0.5 rad."""
    still = [warped(bend) for bend in (-0.6, -0.2, 0.3, 0.5)]
    for number, recording in enumerate(still):
        s = np.linspace(0, 1, len(recording.values))
        recording.values[:, 1] = 0.01 * np.sin((5 + 3 * number) * s + number)
    apart = np.stack([recording.values[:, 0] for recording in still]).std(axis=0, ddof=1)
    together = combine(still)
    assert np.sqrt(np.mean(together.spread[:, 0] ** 2)) < 0.15 * np.sqrt(np.mean(apart**2))


def test_the_spread_is_reported_at_the_joint_and_phase_that_differ() -> None:
    wide = [warped(0.0) for _ in range(5)]
    for number, recording in enumerate(wide):
        recording.values[100:200, 1] += 0.05 * (number - 2) * np.sin(np.linspace(0, np.pi, 100))
    together = combine(wide)
    row, joint = np.unravel_index(together.spread.argmax(), together.spread.shape)
    assert joint == 1
    assert 120 < row < 180
    assert together.spread.max() == pytest.approx(0.05 * np.sqrt(2.5), rel=0.15)


def test_the_weighting_has_a_lower_bound_of_1_percent_of_the_range() -> None:
    together = combine([warped(0.0) for _ in range(3)])
    assert together.spread.max() < 1e-9
    weighting = together.weighting()
    assert weighting.shape == (100, 2)
    assert weighting == pytest.approx(np.tile(0.01 * np.ptp(together.mean.values, axis=0), (100, 1)), rel=1e-6)


def test_recordings_with_different_joints_are_refused() -> None:
    with pytest.raises(Unreadable, match="has other joints than"):
        combine([warped(0.0), warped(0.0, columns=("a", "c"))])
