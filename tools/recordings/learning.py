"""Prepare the samples of a `learn` request from a file: read, matched to the robot's joints, examined, in rad."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from protocol.messages import DURATION_RANGE, MAX_SAMPLES
from tools.recordings import names, readers
from tools.recordings.calibration import in_degrees
from tools.recordings.joints import Matching, Mismatch, match
from tools.recordings.recording import Recording, Unit, Unreadable
from tools.recordings.together import together

EVEN = 0.01
"""Largest relative difference of the steps in a column of times or indices."""

QUATERNION_ERROR = 1e-3
"""Tolerance of a recorded quaternion's length."""

LARGEST = 1e9
"""Bound on the numbers of a joint: more is no angle in any unit, and its square can overflow."""

DEGREE = math.pi / 180

LEROBOT = ".pos"
"""Suffix of joint names in LeRobot's recordings."""


def load(
    path: Path,
    joints: Sequence[str],
    *,
    episode: str | None = None,
    mapping: Mapping[str, str] | None = None,
    unit: Unit | None = None,
    rate: float | None = None,
    duration: float | None = None,
    calibration: Path | None = None,
) -> Recording:
    """Return a movement of a file with one column for each joint of the robot, in its order and with its names.

    Args:
        path: The file.
        joints: The robot's joints; () uses the file's.
        episode: Name or number of the movement, if the file has several.
        mapping: Names of columns, and of their joints.
        unit: Unit of the file's angles; overrides the file's own.
        rate: Samples a second, for a file without times.
        duration: Total to which the times are scaled, s; for recordings over a phase.
        calibration: LeRobot calibration of the arm that recorded positions of -100 to 100.

    Raises:
        Unreadable: the file cannot be used; the sentence names the fault and the cure.
    """
    if calibration is not None and unit is not None:
        raise Unreadable(f"{path}: --calibration converts to degrees; leave out --unit {unit}")
    chosen = arranged(readers.read(path, episode, rate), joints, mapping or {}, unit)
    chosen = chosen if calibration is None else in_degrees(chosen, calibration)
    times = chosen.times if duration is None else _stretched(chosen, duration)
    return replace(chosen, times=times)


def arranged(
    recording: Recording, joints: Sequence[str], mapping: Mapping[str, str], unit: Unit | None = None
) -> Recording:
    """Return the recording with one column a joint, for () the file's, and finite numbers.

    `unit` overrides the file's own.

    Raises:
        Unreadable: a joint has no column, or no numbers.
    """
    ours = tuple(joints) or _own(recording)
    if not recording.columns and not mapping and _are_poses(recording.values):
        raise Unreadable(f"{recording.source} {names.ONLY_POSES.format('x, y, z and a quaternion')}")
    recording = _without_counter(recording, len(ours)) if not mapping else recording
    try:
        matching = match(recording.columns, recording.values.shape[1], ours, mapping)
    except Mismatch as mismatch:
        raise Unreadable("; ".join([f"{recording.source}: {mismatch}", *recording.notes])) from None
    normalised = recording.normalised or any(column.endswith(LEROBOT) for column in recording.columns)
    return together(replace(_selected(recording, ours, matching, unit), normalised=normalised))


def in_radians(recording: Recording) -> Recording:
    """Return a recording in rad, reduced to the planner's largest number of samples.

    Raises:
        Unreadable: the recording is too short.
    """
    length = float(np.ptp(recording.times))
    if length < DURATION_RANGE[0]:
        raise Unreadable(
            f"{recording.source}: {recording.episode} lasts {length:.2g} s by its times, too short for a movement; if "
            "its samples were written all at once, say how many there are a second (--rate) or how long they last "
            "(--duration)"
        )
    every = max(1, math.ceil(len(recording.times) / MAX_SAMPLES))
    note = (f"one sample in {every} is learned, of {len(recording.times)}",) if every > 1 else ()
    values = recording.values[::every]
    return replace(
        recording,
        times=recording.times[::every],
        values=np.radians(values) if recording.unit == "deg" else values,
        unit="rad",
        notes=(*recording.notes, *note),
    )


def _are_poses(values: np.ndarray) -> bool:
    """Return whether unnamed columns are positions and quaternions: the last four of seven have length 1."""
    if values.shape[1] != 7 or not len(values):
        return False
    return bool(np.all(np.abs(np.linalg.norm(values[:, 3:], axis=1) - 1) < QUATERNION_ERROR))


def _own(recording: Recording) -> tuple[str, ...]:
    """Return the file's joints, for a robot without a description."""
    own = tuple(name for name in recording.columns if not names.is_other(name) and not names.is_gripper(name))
    return own or tuple(str(index) for index in range(recording.values.shape[1]))


def _without_counter(recording: Recording, joints: int) -> Recording:
    """Drop an unnamed first column that rises evenly, which is a time or an index but not a joint.

    Raises:
        Unreadable: the column before it was read as the time.
    """
    values = recording.values
    if recording.columns or values.shape[1] <= joints or not _rises_evenly(values[:, 0]):
        return recording
    if recording.stamped:
        raise Unreadable(
            f"{recording.source}: its columns have no names, and more than one rises evenly, as times and indices do; "
            "name them in a first line, or leave out all but the times"
        )
    note = "the first column rises evenly, as a time or an index does, and is left out"
    return replace(recording, values=values[:, 1:], notes=(*recording.notes, note))


def _rises_evenly(column: np.ndarray) -> bool:
    steps = np.diff(column)
    return bool(len(steps) > 1 and np.all(steps > 0) and np.ptp(steps) < EVEN * steps.mean())


def _selected(recording: Recording, joints: Sequence[str], matching: Matching, unit: Unit | None) -> Recording:
    chosen = list(matching.columns)
    values, unit = recording.values[:, chosen], unit or recording.unit
    named = [recording.columns[column] for column in chosen] if recording.columns else []
    if wrong := next(filter(names.is_no_angle, named), None):
        raise Unreadable(f"{recording.source}: {wrong} is not an angle by its name; convert it to rad or degrees")
    scales = {names.scale_of(name) for name in named} - {None}
    if unit is None and scales == {DEGREE}:
        unit = "deg"
    elif unit is None and scales:
        unit, values = "rad", values * [names.scale_of(name) or 1.0 for name in named]
    _check_magnitude(recording.source, joints, values)
    notes = (*recording.notes, *matching.notes)
    return replace(recording, columns=tuple(joints), values=values, unit=unit, notes=notes)


def _check_magnitude(source: Path, joints: Sequence[str], values: np.ndarray) -> None:
    """Raise Unreadable for a number that no joint has; NaN and infinity are missing values."""
    for row, column in np.argwhere(np.isfinite(values) & (np.abs(values) > LARGEST))[:1]:
        raise Unreadable(
            f"{source}: {joints[column]} is {values[row, column]:g} in sample {row}; a joint's number is at most "
            f"{LARGEST:g} in size: delete that sample, or choose another column with --map"
        )


def _stretched(recording: Recording, duration: float) -> np.ndarray:
    times = recording.times
    length = float(times[-1] - times[0])
    if not length > 0:
        raise Unreadable(f"{recording.source}: its times do not rise and cannot be stretched; give --rate instead")
    return (times - times[0]) * (duration / length)
