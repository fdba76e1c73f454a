"""`python -m experiments.doctor`: detection and repair rates for each fault, and false alarms.

The full run writes the tables into docs/recordings.md, between the marks.
"""

import re
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import repeat
from pathlib import Path

import numpy as np
import tyro

from experiments.doctor.clean import PANDA, shipped, synthetic, thirty
from experiments.doctor.mutations import COLUMNS, MUTATIONS, Mutation
from tools.recordings.doctor import Arm, Examination, examine
from tools.recordings.doctor.examination import FAULTS
from tools.recordings.joints import match
from tools.recordings.recording import Recording

PAGE = Path("docs/recordings.md")
BEGIN, END = "<!-- table: faults -->", "<!-- end -->"

FILES = 1000
NEAR = 0.01
"""Largest distance of a repaired recording from the clean one, rad, besides noise and resolution."""


def main(files: int = FILES, seed: int = 1, only: str = "") -> int:
    """Put each fault into recordings, on all cores, and print how often the doctor finds and repairs it.

    Args:
        files: Recordings for each fault; with 1000 the page is written.
        seed: Of all random numbers.
        only: Only the faults with this code.
    """
    chosen = {mutation: seed + 1000 * k for k, mutation in enumerate(MUTATIONS) if only in ("", mutation.code)}
    rows = []
    with ProcessPoolExecutor() as pool:
        for mutation, counts in zip(chosen, pool.map(measure, chosen, repeat(files), chosen.values()), strict=True):
            caught, repaired = counts
            rows.append((mutation, caught, repaired))
            print(f"{mutation.code:12} {mutation.words:60} {caught:5} {'' if repaired is None else repaired:>5}")
    alarms = false_alarms(seed)
    print(f"clean recordings: {len(thirty(seed))}; false alarms: {len(alarms)}", *alarms, sep="\n  ")
    if files == FILES and not only and PAGE.exists():
        write(rows, len(thirty(seed)), len(alarms), files)
    return 0


def measure(mutation: Mutation, files: int, seed: int) -> tuple[int, int | None]:
    """Number of recordings in which the fault is found, and in which it is repaired (None: it has no repair)."""
    arms = shipped(), PANDA
    caught, repaired = 0, 0
    for number in range(files):
        rng = np.random.default_rng([seed, number])
        clean = synthetic(rng, arms[number % 2], mutation.base)
        faulty, column = mutation.put(rng, clean)
        examination = examine(matched(faulty, clean.arm), clean.arm)
        near = distance(examination.recording, clean.recording) < NEAR + 6 * clean.noise + clean.resolution
        repaired += near
        caught += near if mutation.code == COLUMNS else is_caught(examination, mutation.code, column)
    return caught, repaired if mutation.repaired else None


def matched(recording: Recording, arm: Arm) -> Recording:
    """The recording with a column for each joint of the arm."""
    columns = match(recording.columns, recording.values.shape[1], arm.joint_names, {}).columns
    return replace(recording, columns=arm.joint_names, values=recording.values[:, list(columns)])


def is_caught(examination: Examination, code: str, column: str | None) -> bool:
    """Whether a finding has this code, and this column if one is given."""
    return any(found.code == code and column in (None, found.column) for found in examination.findings)


def distance(repaired: Recording, clean: Recording) -> float:
    """Largest distance, rad, of a repaired recording from the clean one, after a constant offset of each column."""
    if repaired.values.shape[1] != clean.values.shape[1]:
        return np.inf
    shown = np.stack([np.interp(repaired.times, clean.times, column) for column in clean.values.T], axis=1)
    beside = repaired.values - shown
    return float(np.abs(beside - np.median(beside, axis=0)).max())


def false_alarms(seed: int, count: int = 30) -> list[str]:
    """Findings in `count` clean recordings; a true finding of motion at the ends is not a false alarm."""
    return [
        f"{clean.recording.source.name}: {found.code}: {found.sentence}"
        for clean in thirty(seed)[-count:]
        for found in examine(clean.recording, clean.arm).findings
        if not (clean.moving and found.code == "moving")
    ]


def write(rows: list[tuple[Mutation, int, int | None]], clean: int, alarms: int, files: int) -> None:
    """Write the tables into the page."""
    cures = {"gripper and other columns": "left out by name", "joint order": "matched by name, or by `--map`"}
    cures |= {fault.name: fault.cure for fault in FAULTS}
    lines = ["| fault | cure |", "|---|---|", *(f"| {name} | {cure} |" for name, cure in cures.items()), ""]
    lines += ["| fault that is put into recordings | recordings | caught | repaired |", "|---|---|---|---|"]
    for mutation, caught, repaired in rows:
        share = "–" if repaired is None else f"{repaired / files:.1%}"
        lines.append(f"| {mutation.code}: {mutation.words} | {files} | {caught / files:.1%} | {share} |")
    lines += ["", f"False alarms on {clean} clean recordings: {alarms}."]
    text = PAGE.read_text()
    marked = re.compile(f"{BEGIN}.*?{END}", re.DOTALL)
    PAGE.write_text(marked.sub("\n".join([BEGIN, *lines, END]), text))


if __name__ == "__main__":
    sys.exit(tyro.cli(main))
