"""What the doctor finds in a recording."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from motion.limits import Limits
from tools.recordings.doctor.signals import ranges
from tools.recordings.recording import Recording

NONE = np.zeros(0, int)


class Robot(Protocol):
    """The arm that plays a recording: the attributes that the doctor needs."""

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
    """A robot that is known by its names and limits alone."""

    joint_names: tuple[str, ...]
    limits: Limits


@dataclass(frozen=True, slots=True, eq=False)
class Finding:
    """One fault of a recording.

    Attributes:
        sentence: What is wrong, and its cure or repair.
        repaired: Whether the doctor repaired it.
        fatal: The recording cannot be learned.
        column: The column's name; None where it is about all of them.
        rows: Indices of the samples, in the recording as it was when this fault was looked for.
        times: Of these samples, s, as the file has them.
        planner_says: The planner warns of the same when it learns.
        code: Of the fault in the table of faults; `examine` fills it in, and the times.
    """

    sentence: str
    repaired: bool = False
    fatal: bool = False
    column: str | None = None
    rows: np.ndarray = field(default_factory=lambda: NONE)
    times: np.ndarray = field(default_factory=lambda: NONE.astype(float))
    planner_says: bool = False
    code: str = ""

    @property
    def spans(self) -> list[tuple[float, float]]:
        """First and last time of each run of neighbouring samples, s."""
        at = np.searchsorted(self.rows, [end for run in ranges(self.rows) for end in run])
        return [(float(self.times[first]), float(self.times[last])) for first, last in at.reshape(-1, 2)]


@dataclass(frozen=True, slots=True, eq=False)
class Examination:
    """A recording after the doctor: what he found, and the recording with what he repaired.

    `recording` is in rad and its times rise, unless there is a `refusal`.
    """

    recording: Recording
    findings: tuple[Finding, ...]

    @property
    def refusal(self) -> Finding | None:
        """The finding that keeps the recording from being learned, or None."""
        return next((finding for finding in self.findings if finding.fatal), None)


def kept(recording: Recording, findings: Sequence[Finding]) -> np.ndarray:
    """Return which samples (n,) of a recording belong to none of the findings."""
    keep = np.ones(len(recording.times), bool)
    for finding in findings:
        keep[finding.rows] = False
    return keep
