"""The table of faults, and the examination by this table."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from tools.recordings.doctor import angles, frames, movement, samples, stamps, stutter
from tools.recordings.doctor.finding import Examination, Finding, Robot
from tools.recordings.recording import Recording

Detector = Callable[[Recording, Robot | None], Iterator[Finding]]
Repair = Callable[[Recording, list[Finding], Robot | None], Recording]


@dataclass(frozen=True, slots=True)
class Fault:
    """One kind of fault.

    Attributes:
        code: Code of its findings.
        name: Name in words.
        cure: What the doctor does about it, or what the user can do.
        detector: Yields a finding for each occurrence.
        repair: Repairs the findings that are marked as repaired.
        always: Whether the repair also applies without findings, because later detectors expect its result.
    """

    code: str
    name: str
    cure: str
    detector: Detector
    repair: Repair | None = None
    always: bool = False


FAULTS: tuple[Fault, ...] = (
    Fault("backwards", "stamps that go back", "sorted; two recordings are refused", stamps.backwards, stamps.sort_rows),
    Fault("duplicates", "samples with one stamp", "left out", stamps.duplicates, stamps.drop_rows),
    Fault("short", "too few samples", "refused", stamps.too_short),
    Fault(
        "degrees", "degrees", "converted, except from rad or LeRobot", angles.degrees, angles.to_radians, always=True
    ),
    Fault("wraps", "wraps at ±π or ±360°", "made continuous", angles.wraps, angles.unwrap),
    Fault("spikes", "spikes", "interpolated", samples.spikes, samples.interpolated),
    Fault("still", "no movement", "refused", movement.still),
    Fault("duplicates", "samples that repeat the one before", "left out", frames.repeated, stamps.drop_rows),
    Fault("synthetic", "synthetic stamps, frames repeated", "left out", frames.synthetic, frames.drop_with_time),
    Fault("synthetic", "synthetic stamps, frames lost", "record the times of capture", frames.lost),
    Fault("jitter", "jitter", "evened out", stamps.jitter, stamps.even_out),
    Fault("stutter", "samples early or late", "their times are moved", stutter.stutter, stutter.retime),
    Fault("idle", "idle ends", "trimmed", movement.idle_ends, stamps.drop_rows),
    Fault("short", "too few samples", "refused", stamps.too_short),
    Fault("gap", "gaps", "filled by the spline; record again if it matters there", stamps.gaps),
    Fault("frozen", "frozen columns", "record again, or leave that part out", samples.frozen),
    Fault("range", "positions outside the arm's ranges", "check unit, order and arm", angles.out_of_range),
    Fault("speed", "implausible speeds", "check the units of positions and times", movement.speeds),
    Fault("moving", "begins or ends in motion", "play by `--place-time 0.05`, or record rest", movement.ends_in_motion),
)
"""Faults in the order of detection: each detector relies on earlier repairs."""


def examine(recording: Recording, robot: Robot | None) -> Examination:
    """Find the faults of a recording, and repair those that are safe to repair.

    `recording` has finite numbers and a named column for each joint of the arm, in its order, as
    `tools.recordings.learning.load` returns it. `robot` is the arm that will play it: any object with `joint_names` and
    `limits`, or None if unknown.
    """
    findings: list[Finding] = []
    for fault in FAULTS:
        found = [_complete(finding, fault.code, recording) for finding in fault.detector(recording, robot)]
        findings += found
        if any(finding.fatal for finding in found):
            break
        repaired = [finding for finding in found if finding.repaired]
        if fault.repair and (repaired or fault.always):
            recording = fault.repair(recording, repaired, robot)
    return Examination(recording, tuple(findings))


def _complete(finding: Finding, code: str, recording: Recording) -> Finding:
    """Return the finding with its code and the times of its samples."""
    return replace(finding, code=code, times=recording.times[finding.rows])
