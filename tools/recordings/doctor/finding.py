"""Findings of the doctor."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from motion.limits import Limits
from tools.recordings.doctor.signals import adjacent_runs
from tools.recordings.recording import Recording

NONE = np.zeros(0, int)


class Robot(Protocol):
    """The arm that will play a recording, as the doctor needs it."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of its J joints, in the order of every vector."""
        ...

    @property
    def limits(self) -> Limits:
        """Limits of its J joints."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """A robot given by its joint names and limits."""

    joint_names: tuple[str, ...]
    limits: Limits


@dataclass(frozen=True, slots=True, eq=False)
class Finding:
    """One fault of a recording.

    Attributes:
        sentence: The fault, and its cure or repair.
        repaired: Whether the doctor repaired it.
        fatal: Whether it prevents learning.
        column: Name of the column; None for all columns.
        rows: Indices of the samples, in the recording at the time of detection.
        times: Times of these samples in the file, s.
        planner_warns: Whether the planner gives the same warning when it learns.
        code: Code in the table of faults; `examine` sets it and the times.
    """

    sentence: str
    repaired: bool = False
    fatal: bool = False
    column: str | None = None
    rows: np.ndarray = field(default_factory=lambda: NONE)
    times: np.ndarray = field(default_factory=lambda: NONE.astype(float))
    planner_warns: bool = False
    code: str = ""

    @property
    def spans(self) -> list[tuple[float, float]]:
        """First and last time of each run of adjacent samples, s."""
        at = np.searchsorted(self.rows, [end for run in adjacent_runs(self.rows) for end in run])
        return [(float(self.times[first]), float(self.times[last])) for first, last in at.reshape(-1, 2)]


@dataclass(frozen=True, slots=True, eq=False)
class Examination:
    """Result of an examination: the findings, and the repaired recording.

    `recording` is in rad with rising times, unless there is a `refusal`.
    """

    recording: Recording
    findings: tuple[Finding, ...]

    @property
    def refusal(self) -> Finding | None:
        """The finding that prevents learning, or None."""
        return next((finding for finding in self.findings if finding.fatal), None)


def kept_samples(recording: Recording, findings: Sequence[Finding]) -> np.ndarray:
    """Return which samples (n,) of a recording belong to no finding."""
    keep = np.ones(len(recording.times), bool)
    for finding in findings:
        keep[finding.rows] = False
    return keep
