"""`python -m experiments.repetitions DIRECTORY`: several recordings learned together, beside ProMPs, leave one out.

Each recording of a letter is predicted from the others under its own start, end, duration and largest speeds: by the
plan that imitates their mean (`tools.recordings.several`), and by the ProMP of movement_primitives, conditioned on the
same start and end. DIRECTORY holds one .mat file a letter, as pbdlib's 2Dletters: 10 to 15 recordings each.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import tyro
from movement_primitives.promp import ProMP
from scipy.io import loadmat
from tyro.conf import Positional

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.plan import Plan, plan
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest
from tools.recordings.recording import Recording
from tools.recordings.several import combine

DURATION = 2.0
"""s; the recordings have no times."""

PAPER = 0.04
"""Joint angle, rad, for a unit of paper: a letter becomes about 0.6 rad."""

WEIGHTS = 20
"""Of a ProMP, a dimension: the best of 10, 20 and 40 on the letter A."""

ROUNDING = 1e-3
"""Part of a limit that is no excess."""


def main(directory: Positional[Path], only: str = "") -> int:
    """Print a table.

    Args:
        directory: Of .mat files.
        only: Only these letters, as AGS.
    """
    print("| letter | recordings | error of the plan, rad | of the ProMP | past a limit: plan | ProMP |")
    print("|---|---|---|---|---|---|")
    for path in sorted(directory.glob("*.mat")):
        if only and path.stem not in only:
            continue
        recordings = list(letter(path))
        rows = np.array([left_out(recordings, number) for number in range(len(recordings))])
        errors, passed = rows[:, :2].mean(axis=0), rows[:, 2:].sum(axis=0).astype(int)
        print(
            f"| {path.stem} | {len(rows)} | {errors[0]:.4f} | {errors[1]:.4f} | {passed[0]} | {passed[1]} |", flush=True
        )
    return 0


def letter(path: Path) -> Iterator[Recording]:
    """Yield the recordings of a letter, x and y as two joints."""
    for demonstration in loadmat(str(path))["demos"][0]:
        values = PAPER * demonstration["pos"][0, 0].T
        times = np.linspace(0, DURATION, len(values))
        yield Recording(times, ("x", "y"), values, "rad", path, path.stem, False)


def left_out(recordings: list[Recording], number: int) -> tuple[float, float, bool, bool]:
    """Rms errors, rad, of plan and ProMP on one recording, learned from the others, and whether each passes a limit."""
    shown, others = recordings[number], recordings[:number] + recordings[number + 1 :]
    own = learned(shown)
    s = (shown.times - shown.times[0]) / DURATION
    limit = np.abs(own.sample(np.linspace(0, 1, 1001)).velocities).max(axis=0)
    ours = _plan(learned(combine(others).mean), own, limit).sample(shown.times)
    theirs = _promp(others, shown)
    means = theirs.mean_trajectory(s)
    speeds = theirs.mean_velocities(s) / DURATION
    passed, their_passed = (
        bool((np.abs(velocities) > (1 + ROUNDING) * limit).any()) for velocities in (ours.velocities, speeds)
    )
    return _rms(ours.positions - shown.values), _rms(means - shown.values), passed, their_passed


def learned(recording: Recording) -> Primitive:
    """The primitive of a recording."""
    return learn(Demonstration(recording.times, recording.values))


def _plan(mean: Primitive, own: Primitive, limit: np.ndarray) -> Plan:
    free = np.full(2, np.nan)
    start, goal = (Boundary(end.positions, end.velocities, free) for end in (own.start, own.goal))
    none = Limits.unlimited(2)
    limits = Limits(none.positions, limit * (1 + ROUNDING / 2), none.accelerations, none.jerks)
    return plan(mean, MotionRequest(start, goal, DURATION, limits, tail="coast"))


def _promp(others: list[Recording], shown: Recording) -> ProMP:
    learned = ProMP(2, WEIGHTS)
    learned.imitate([other.times / DURATION for other in others], [other.values for other in others])
    for position, s in ((shown.values[0], 0), (shown.values[-1], 1)):
        learned = learned.condition_position(position, 1e-8 * np.eye(2), s, 1.0)
    return learned


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    sys.exit(tyro.cli(main))
