"""Faults of samples: outliers, and columns that are frozen while the arm moves."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from robot.recordings.inspection import spoken_time
from tools.recordings.doctor.finding import NONE, Finding, Robot
from tools.recordings.doctor.signals import (
    LEAST_NOISE,
    adjacent_runs,
    counted,
    interpolation_errors,
    noise,
    noise_floor,
    resolution,
    usual_step,
)
from tools.recordings.recording import Recording

OUTLIER = 12.0
"""The distance of an outlier from its neighbours' curve exceeds this multiple of the usual distance around it …"""

OUTLIER_NOISE_FLOORS, OUTLIER_FLOOR = 8.0, 0.003
"""… this multiple of the noise floor, and this distance, rad."""

LONGEST_OUTLIER = 3
"""Largest number of consecutive samples in one outlier."""

END_STEP = 8.0
"""The first or last sample is an outlier if its step exceeds this multiple of the largest step near it."""

AROUND = 12
"""Number of samples on either side that define the usual distance."""

FROZEN, FROZEN_SAMPLES = 0.1, 6
"""A frozen column keeps its value for at least this time, s, and this number of samples."""

FLICKER = 4.0
"""A column whose noise exceeds this multiple of its resolution does not keep its value by chance."""

TURNS, TOGETHER, APART = (2, 3, 4), 0.2, 0.02
"""Two movements alternate where samples so many places apart are nearer than this part of those that are adjacent, and
these differ by more than this, rad."""

SUDDEN, STEPS = 0.3, 3
"""A column stops or starts suddenly if its last step exceeds this fraction of the steps before and this multiple of its
resolution."""


def interleaved(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Samples of two movements in turn, as two arms make them that publish on one topic under the same names."""
    values = recording.values
    if len(values) <= AROUND:
        return
    adjacent = _usual_steps(values, 1)
    nearest = np.min([_usual_steps(values, places) for places in TURNS], axis=0)
    alternate = (adjacent > APART) & (nearest < TOGETHER * adjacent)
    if not alternate.any():
        return
    number = int(np.argmax(np.where(alternate, adjacent, 0.0)))
    row = int(np.argmax(np.abs(np.diff(values[:, number])) > APART))
    pair = ", then at ".join(f"{value:.3f}" for value in values[row : row + 2, number])
    sentence = (
        f"it has samples of two movements in turn: {recording.columns[number]} is at {pair} rad from sample {row} to "
        f"{row + 1}, and so on; if two arms publish under the same names, record each on a topic of its own"
    )
    yield Finding(sentence, fatal=True, column=recording.columns[number], rows=np.array([row, row + 1]))


def _usual_steps(values: np.ndarray, places: int) -> np.ndarray:
    """Return the median distance (C,) of samples so many places apart."""
    return np.median(np.abs(values[places:] - values[:-places]), axis=0)


def spikes(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find outliers: one to three consecutive samples far from the curve of their neighbours."""
    floor = np.maximum(OUTLIER_NOISE_FLOORS * noise_floor(recording), OUTLIER_FLOOR)
    for number, column in enumerate(recording.columns):
        values = recording.values[:, number]
        found = _outliers(recording.times, values, float(floor[number]))
        rows = np.union1d(found, _ends(values, float(floor[number])))
        if len(rows):
            sentence = (
                f"{column} has {counted(len(rows), 'outlier')}, the first at "
                f"{spoken_time(recording.times[rows[0]])}: replaced by the line between their neighbours"
            )
            yield Finding(sentence, True, column=column, rows=rows)


def interpolated(recording: Recording, findings: list[Finding], robot: Robot | None) -> Recording:
    """Return the recording with the samples of the findings interpolated linearly."""
    values = recording.values.copy()
    for finding in findings:
        assert finding.column is not None
        number = recording.columns.index(finding.column)
        good = np.setdiff1d(np.arange(len(values)), finding.rows)
        values[finding.rows, number] = np.interp(
            recording.times[finding.rows], recording.times[good], values[good, number]
        )
    return replace(recording, values=values)


def frozen(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Find columns that keep their value while the arm moves."""
    times, values = recording.times, recording.values
    sizes, steps = noise(times, values), resolution(values)
    flickers = (sizes > 0) & (FLICKER * steps < sizes)
    longest = max(FROZEN_SAMPLES, round(FROZEN / usual_step(times)))
    for number, column in enumerate(recording.columns):
        runs = [
            (first, last) for first, last in _runs(values[:, number])
            if last - first + 1 >= longest and _others_move(values, number, first, last, np.maximum(sizes, steps))
        ]  # fmt: skip
        if np.ptp(values[:, number]) == 0:
            others = np.delete(flickers, number)
            runs = runs if len(others) and others.all() else []
        elif not flickers[number]:
            runs = [run for run in runs if _is_sudden(values[:, number], *run, float(steps[number]))]
        if runs:
            first, last = max(runs, key=lambda run: run[1] - run[0])
            sentence = (
                f"{column} stays at {values[first, number]:.4g} rad for {times[last] - times[first]:.3g} s from "
                f"{spoken_time(times[first])} on, while the other joints move: its sensor or connection stopped; "
                "record again, or leave that part out"
            )
            rows = np.concatenate([np.arange(first, last + 1) for first, last in runs])
            yield Finding(sentence, column=column, rows=rows)


def _outliers(times: np.ndarray, values: np.ndarray, floor: float) -> np.ndarray:
    """Return the indices of outliers, sorted."""
    found: set[int] = set()
    values = values.copy()
    rows = NONE
    for _ in range(2):  # an outlier hides a smaller one next to it
        distances = np.abs(interpolation_errors(times, values[:, None])[:, 0])
        for peak in np.flatnonzero(distances > floor / 2).tolist():
            for row in _outlier_at(times, values, distances, peak, floor):
                found.add(row)
        rows = np.array(sorted(found), int)
        good = np.setdiff1d(np.arange(len(values)), rows)
        values[rows] = np.interp(times[rows], times[good], values[good])
    return rows


def _ends(values: np.ndarray, floor: float) -> np.ndarray:
    """Return the first and last sample if they are outliers, for example a number cut short when a program stopped."""
    steps = np.abs(np.diff(values))
    ends = (0, steps[0], steps[1 : AROUND + 1]), (len(values) - 1, steps[-1], steps[-AROUND - 1 : -1])
    return np.array([row for row, step, near in ends if step > max(floor, END_STEP * near.max())], int)


def _outlier_at(times: np.ndarray, values: np.ndarray, distances: np.ndarray, first: int, floor: float) -> range:
    """Return the samples of an outlier that begins at `first`; none if it is no outlier."""
    for count in range(1, LONGEST_OUTLIER + 1):
        block = range(first, first + count)
        left, right = [first - 2, first - 1], [first + count, first + count + 1]
        if left[0] < 0 or right[1] >= len(values):
            break
        size = _stands_out(times, values, block, left, right)
        if size > floor and size > OUTLIER * _usual(distances, first):
            return block
    return range(0)


def _usual(distances: np.ndarray, row: int) -> float:
    """Return the median distance of the samples around one, without its nearest neighbours."""
    around = np.arange(max(row - AROUND, 2), min(row + AROUND + 1, len(distances) - 2))
    far = around[np.abs(around - row) > LONGEST_OUTLIER + 1]
    return float(np.median(distances[far])) if len(far) else np.inf


def _stands_out(times: np.ndarray, values: np.ndarray, block: range, left: list[int], right: list[int]) -> float:
    """Return the distance of a block from the lines before and after it, or 0 if these disagree."""
    rows = np.array(block)
    middle = np.interp(times[rows], times[[left[1], right[0]]], values[[left[1], right[0]]])
    beyond = values[rows] - middle
    size = float(np.abs(beyond).min())
    if abs(np.sum(np.sign(beyond))) < len(rows) or abs(values[right[0]] - values[left[1]]) >= size:
        return 0.0
    for near, far, at in ((left[1], left[0], rows[0]), (right[0], right[1], rows[-1])):
        slope = (values[near] - values[far]) / (times[near] - times[far])
        off = values[at] - (values[near] + slope * (times[at] - times[near]))
        if off * beyond[0] < 0 or abs(off) < size / 2:
            return 0.0
    return size


def _runs(column: np.ndarray) -> list[tuple[int, int]]:
    """Return the first and last index of each run of equal values."""
    same = np.flatnonzero(np.diff(column) == 0)
    return [(first, last + 1) for first, last in adjacent_runs(same)]


def _others_move(values: np.ndarray, number: int, first: int, last: int, sizes: np.ndarray) -> bool:
    others = np.delete(values[first : last + 1], number, axis=1)
    return bool(np.any(np.ptp(others, axis=0) > 10 * np.delete(sizes, number) + 1e-3))


def _is_sudden(column: np.ndarray, first: int, last: int, step: float) -> bool:
    """Return whether a column stops at `first`, or starts after `last`, at full speed."""
    steps = np.abs(np.diff(column))
    ends = []
    if first >= 6:
        ends.append((steps[first - 1], np.median(steps[first - 6 : first - 1])))
    if last + 6 < len(steps):
        ends.append((steps[last], np.median(steps[last + 1 : last + 6])))
    return any(size > max(STEPS * step, SUDDEN * usual, LEAST_NOISE) for size, usual in ends)
