"""Faults of angles: degrees, wraps, positions outside the arm's ranges."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from motion.demonstration import Demonstration
from robot.recordings.inspection import spoken_time
from robot.recordings.plausibility import OUTSIDE, TURN_TOLERANCE, outside
from tools.recordings.doctor.finding import Finding, Robot
from tools.recordings.doctor.signals import counted
from tools.recordings.recording import Recording

TURN = 2 * np.pi

NORMALISED = (
    "degrees, or -100 to 100 of each joint's calibrated range, which LeRobot records without use_degrees; give "
    "--unit deg, or the arm's calibration by --calibration FILE.json"
)

SMALL = (
    "arms of LeRobot record degrees, or -100 to 100, and a small movement does not show which: give --unit deg, or the "
    "arm's calibration by --calibration FILE.json, or --unit rad if they are in rad"
)

FEW = 0.01
"""Largest fraction of samples that may be outliers."""


def degrees(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find positions that are too large for rad but plausible in degrees, or too large for both."""
    largest = float(np.quantile(np.abs(recording.values), 1 - FEW))
    if robot is None:
        # Without a robot: no joint makes two turns, and no joint of an arm is at 400°.
        fits, strange = 2 * TURN < largest <= np.degrees(TURN), False
    else:
        plain, converted = _excess(recording.values, robot), _excess(np.radians(recording.values), robot)
        fits = converted <= OUTSIDE < plain and largest > TURN + OUTSIDE
        strange = (converted if recording.unit == "deg" else plain) > TURN + OUTSIDE
    if recording.unit is None and recording.normalised and (fits or strange):
        yield Finding(f"positions reach {largest:.4g}: {NORMALISED}", fatal=True)
    elif recording.unit is None and recording.normalised:
        yield Finding(f"positions reach {largest:.4g} and are taken as rad; {SMALL}")
    elif fits and recording.unit is None:
        yield Finding(f"positions reach {largest:.4g}, so they are in degrees: converted to rad", True)
    elif (fits and recording.unit == "rad") or strange:
        unit = recording.unit or "rad"
        sentence = f"positions reach {largest:.4g} {unit}, more than a turn beyond the arm's ranges; "
        cure = "if they are in degrees, give --unit deg, else convert them" if unit == "rad" else "convert them"
        yield Finding(sentence + cure, fatal=True)


def to_radians(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """Return the recording in rad; it is in degrees by its own unit or by the findings."""
    in_degrees = recording.unit == "deg" or any(finding.repaired for finding in findings)
    return replace(recording, values=np.radians(recording.values) if in_degrees else recording.values, unit="rad")


def wraps(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find jumps of a column by a full turn from one sample to the next."""
    steps = np.abs(np.diff(recording.values, axis=0))
    wrapped = np.abs(steps - TURN * np.round(steps / TURN)) < TURN_TOLERANCE
    wrapped &= steps > TURN - TURN_TOLERANCE
    for number in np.flatnonzero(wrapped.any(axis=0)).tolist():
        rows = np.flatnonzero(wrapped[:, number]) + 1
        sentence = (
            f"{recording.columns[number]} jumps by a full turn {counted(len(rows), 'time')}, first at "
            f"{spoken_time(recording.times[rows[0]])}: the angle was wrapped, and is made continuous"
        )
        yield Finding(sentence, True, column=recording.columns[number], rows=rows)


def unwrap(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """Return the recording with continuous angles, shifted by full turns into the arm's ranges."""
    values = recording.values.copy()
    for finding in findings:
        assert finding.column is not None
        number = recording.columns.index(finding.column)
        steps = np.diff(values[:, number])
        turns = np.zeros(len(values))
        turns[finding.rows] = TURN * np.round(steps[finding.rows - 1] / TURN)
        values[:, number] -= np.cumsum(turns)
        values[:, number] += _turns_into_range(values[:, number], number, robot)
    return replace(recording, values=values)


def out_of_range(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find positions outside the arm's ranges, with a likely cause."""
    if robot is None:
        return
    low, high = robot.limits.positions.T
    excess = np.maximum(recording.values - high, low - recording.values)
    number = int(excess.max(axis=0).argmax())
    for sentence in outside(Demonstration(recording.times, recording.values), robot.limits, robot.joint_names):
        rows = np.flatnonzero(excess[:, number] > OUTSIDE)
        yield Finding(sentence, column=recording.columns[number], rows=rows, planner_warns=True)


def _turns_into_range(values: np.ndarray, number: int, robot: Robot | None) -> float:
    """Return the full turns, rad, that bring a column nearest to its joint's range; 0 if it is inside."""
    if robot is None:
        return 0.0
    low, high = robot.limits.positions[number]
    shifts = TURN * np.array([0, -1, 1, -2, 2])
    excess = [max(values.max() + shift - high, low - values.min() - shift, 0.0) for shift in shifts]
    return float(shifts[int(np.argmin(excess))])


def _excess(values: np.ndarray, robot: Robot) -> float:
    """Return the distance of a joint from its range, rad, except for a few samples, which may be outliers."""
    low, high = robot.limits.positions.T
    lowest, highest = np.quantile(values, [FEW, 1 - FEW], axis=0)
    return float(np.maximum(highest - high, low - lowest).max())
