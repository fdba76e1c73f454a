"""Units that values alone do not determine: LeRobot's normalised range, and values in neither rad nor degrees."""

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from motion.limits import Limits
from tools.recordings.doctor import Arm, examine
from tools.recordings.learning import load
from tools.recordings.recording import Recording, Unreadable

TWO = "shoulder", "elbow"
ARM = Arm(TWO, Limits(np.array([[-2.0, 2.0]] * 2), *np.full((3, 2), [[10.0], [100.0], [1e4]])))
RANGES = {"shoulder": (1000, 3000), "elbow": (900, 3100), "gripper": (2000, 3000)}


def recorded(tmp_path: Path, values: np.ndarray, ending: str = ".pos", **options) -> Recording:
    s = np.arange(150) / 149
    path = s**3 * (10 + s * (6 * s - 15))
    lines = "".join(f"{k / 100},{a},{b},50\n" for k, (a, b) in enumerate(path[:, None] * values))
    file = tmp_path / "demo.csv"
    file.write_text(f"t,shoulder{ending},elbow{ending},gripper{ending}\n{lines}", encoding="utf-8")
    return load(file, TWO, **options)


def calibration(tmp_path: Path, **fields) -> Path:
    file = tmp_path / "arm.json"
    joints = {name: {"id": 1, "homing_offset": 5, "drive_mode": 0, "range_min": low, "range_max": high} | fields
              for name, (low, high) in RANGES.items()}  # fmt: skip
    file.write_text(json.dumps(joints), encoding="utf-8")
    return file


def test_a_normalised_range_is_not_taken_for_degrees(tmp_path: Path):
    refusal = examine(recorded(tmp_path, np.array([60.0, -80.0])), ARM).refusal
    assert refusal and "degrees, or -100 to 100" in refusal.sentence
    assert "--unit deg" in refusal.sentence and "--calibration" in refusal.sentence


def test_a_calibration_converts_a_normalised_range_to_degrees(tmp_path: Path):
    """With LeRobot's `use_degrees`: (ticks − middle of the range) · 360 / 4095."""
    raw = recorded(tmp_path, np.array([60.0, -80.0]), calibration=calibration(tmp_path))
    assert (raw.unit, raw.values[-1]) == ("deg", pytest.approx([0.6 * 1000 * 360 / 4095, -0.8 * 1100 * 360 / 4095]))
    assert examine(raw, ARM).refusal is None
    inverted = recorded(tmp_path, np.array([60.0, -80.0]), calibration=calibration(tmp_path, drive_mode=1))
    assert np.array_equal(inverted.values, -raw.values)


def test_an_invalid_or_unsuitable_calibration_is_refused(tmp_path: Path):
    file = calibration(tmp_path)
    with pytest.raises(Unreadable, match="beyond -100 to 100"):
        recorded(tmp_path, np.array([60.0, -130.0]), calibration=file)
    with pytest.raises(Unreadable, match="no column for elbow"):
        file.write_text(json.dumps({"shoulder": {"range_min": 0, "range_max": 9, "drive_mode": 0}}), encoding="utf-8")
        recorded(tmp_path, np.array([60.0, -80.0]), calibration=file)
    with pytest.raises(Unreadable, match="not a LeRobot calibration"):
        file.write_text("[1, 2]", encoding="utf-8")
        recorded(tmp_path, np.array([60.0, -80.0]), calibration=file)
    with pytest.raises(Unreadable, match="cannot be read"):
        recorded(tmp_path, np.array([60.0, -80.0]), calibration=tmp_path / "none.json")


def test_units_stored_next_to_arrays_are_read(tmp_path: Path):
    """In HDF5 an attribute, in NPZ an array of text; times may be dates."""
    times, values = np.arange(20) / 100, np.ones((20, 2))
    with h5py.File(tmp_path / "demo.h5", "w") as file:
        file["qpos"], file["t"] = values, times
        file["qpos"].attrs["units"] = "degrees"
    assert load(tmp_path / "demo.h5", TWO).unit == "deg"
    dates = np.datetime64("2026-11-29T12:00:00", "ns") + np.round(times * 1e9).astype("timedelta64[ns]")
    np.savez(tmp_path / "demo.npz", timestamps=dates, positions=values, unit=np.array("deg"))
    recording = load(tmp_path / "demo.npz", TWO)
    assert (recording.unit, recording.times.tolist()) == ("deg", pytest.approx(times))


def test_time_stamps_coarser_than_the_sample_period_are_refused(tmp_path: Path):
    """100 Hz with a resolution of 0.1 s: dropping samples with equal stamps would shift the others in time."""
    raw = recorded(tmp_path, np.array([1.0, -1.0]), "")
    refusal = examine(replace(raw, times=np.floor(raw.times * 10) / 10), ARM).refusal
    assert refusal and "too coarse; give --rate" in refusal.sentence


@pytest.mark.parametrize("size", [2000.0, 60_000.0])
def test_values_in_neither_rad_nor_degrees_are_refused(tmp_path: Path, size: float):
    """Encoder ticks and thousandths of a degree."""
    refusal = examine(recorded(tmp_path, np.array([size, -size]), ""), ARM).refusal
    assert refusal and "more than a turn beyond the arm's ranges" in refusal.sentence
