"""LeRobot's calibration of an arm, which converts positions in per cent of each joint's range to angles."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from tools.recordings.joints import Mismatch, match
from tools.recordings.recording import Recording, Unreadable

TICKS = 4095
"""Encoder ticks of a turn in LeRobot, for the servos of SO-100, SO-101 and Koch arms."""

PERCENT = 100.0
BEYOND = 0.5
"""Tolerance outside the range, per cent."""

FIELDS = "range_min", "range_max", "drive_mode"
WANTED = "LeRobot keeps one below ~/.cache/huggingface/lerobot/calibration/robots"


def in_degrees(recording: Recording, file: Path) -> Recording:
    """Convert positions of -100 to 100 to the degrees that LeRobot records with `use_degrees`: 0 is mid-range.

    `recording` has a column for each joint of the robot; the calibration's names are matched to these.

    Raises:
        Unreadable: the file is not such a calibration, lacks a joint, or the positions exceed the range or have a unit.
    """
    if recording.unit is not None:
        raise Unreadable(
            f"{recording.source} says that its angles are in {recording.unit}; a calibration converts -100 to 100: "
            "leave out --calibration"
        )
    try:
        known = json.loads(file.read_text(encoding="utf-8"))
        ranges = {name: [int(one[field]) for field in FIELDS] for name, one in known.items()}
    except OSError as error:
        raise Unreadable(f"{file} cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        needs = f"a range_min, range_max and drive_mode for each joint; {WANTED}"
        raise Unreadable(f"{file} is not a LeRobot calibration: it needs {needs}") from None
    try:
        columns = match(tuple(ranges), len(ranges), recording.columns, {}).columns
    except Mismatch as mismatch:
        raise Unreadable(f"{file}: {mismatch}") from None
    largest = float(np.nanmax(np.abs(recording.values), initial=0.0))
    if largest > PERCENT + BEYOND:
        raise Unreadable(
            f"{recording.source}: positions reach {largest:.4g}, beyond -100 to 100, so no calibration applies; "
            "leave out --calibration"
        )
    low, high, inverted = np.array([list(ranges.values())[column] for column in columns], dtype=float).T
    degrees = np.where(inverted, -1, 1) * (high - low) / 2 / PERCENT * 360 / TICKS
    note = f"positions of -100 to 100 are parts of the ranges in {file.name}"
    return replace(recording, values=recording.values * degrees, unit="deg", notes=(*recording.notes, note))
