"""`python -m experiments.repetitions DIRECTORY`: learn from several recordings, compared with ProMPs, leave one out.

Each recording of a letter is predicted from the others under its own start, end, duration and largest speeds. Three
methods are compared: the plan that imitates the mean of the others (`tools.recordings.several`), the same plan with
positions weighted by the spread, and the ProMP of movement_primitives, conditioned on the same start and end. All three
get positions only; the plans begin and end with the mean's velocities. In a second case they also get the recording's
position in the middle of its duration. DIRECTORY holds one .mat file a letter, as pbdlib's 2Dletters: 10 to 15
recordings each.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import tyro
from movement_primitives.promp import ProMP
from scipy.io import loadmat
from tyro.conf import Positional

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.plan import Plan, plan
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest, Waypoint
from tools.recordings.recording import Recording
from tools.recordings.several import Several, combine

DURATION = 2.0
"""s; the recordings have no times."""

PAPER = 0.04
"""Joint angle, rad, of one unit of paper: a letter is about 0.6 rad large."""

WEIGHTS = 20
"""Basis functions of a ProMP for each dimension: the best of 10, 20 and 40 on the letter A."""

ROUNDING = 1e-3
"""Part of a limit by which it may be exceeded."""

MIDDLE = 0.5
"""Phase of the additional position in the second case."""

CASES = {"ends": (), "ends and middle": (MIDDLE,)}
"""Phases at which a prediction gets the recording's position, besides both ends."""

METHODS = "plan", "plan, by spread", "ProMP"


class Predicted(NamedTuple):
    """Positions and velocities (n, 2) of a prediction at a recording's samples, rad and rad/s."""

    positions: np.ndarray
    velocities: np.ndarray


def main(directory: Positional[Path], only: str = "") -> int:
    """Print a table.

    Args:
        directory: Of .mat files.
        only: Only these letters, as AGS.
    """
    heads = [f"{method}, {case}" for case in CASES for method in METHODS]
    print("| letter | recordings |", *(f"{head} |" for head in heads), "past a limit: plans | ProMP, ends |")
    print("|---" * (4 + len(heads)) + "|")
    total = []
    for path in sorted(directory.glob("*.mat")):
        if only and path.stem not in only:
            continue
        recordings = list(letter(path))
        rows = [left_out(recordings, number) for number in range(len(recordings))]
        errors, passed = (np.array([row[k] for row in rows]) for k in (0, 1))
        total.append(errors.mean(axis=0))
        _print(path.stem, str(len(rows)), total[-1], passed.sum(axis=0))
    if len(total) > 1:
        shares = np.array(total)
        _print("mean", "", shares.mean(axis=0), None)
        for k, case in enumerate(CASES):
            plain, weighted, theirs = shares[:, 3 * k : 3 * k + 3].T
            better = np.count_nonzero(plain <= theirs), np.count_nonzero(weighted <= theirs)
            print(f"{case}: error not above the ProMP's on {better[0]} letters of {len(shares)}, by spread {better[1]}")
    return 0


def _print(name: str, count: str, errors: np.ndarray, passed: np.ndarray | None) -> None:
    counts = ("", "") if passed is None else (str(passed[:2].sum()), str(passed[2]))
    print(" | ".join([f"| {name}", count, *(f"{error:.4f}" for error in errors), *counts]), "|", flush=True)


def letter(path: Path) -> Iterator[Recording]:
    """Yield the recordings of a letter, with x and y as two joints."""
    for demonstration in loadmat(str(path))["demos"][0]:
        values = PAPER * demonstration["pos"][0, 0].T
        times = np.linspace(0, DURATION, len(values))
        yield Recording(times, ("x", "y"), values, "rad", path, path.stem, False)


def left_out(recordings: list[Recording], number: int) -> tuple[list[float], list[bool]]:
    """Rms errors, rad, on one recording learned from the others, and whether the predictions exceed a limit.

    One of each for every method in every case.
    """
    shown, others = recordings[number], recordings[:number] + recordings[number + 1 :]
    own = learned(shown)
    limit = np.abs(own.sample(np.linspace(0, 1, 1001)).velocities).max(axis=0)
    together = combine(others)
    mean, weighted = learned(together.mean), learned(together.mean, together)
    promp = ProMP(2, WEIGHTS)
    promp.imitate([other.times / DURATION for other in others], [other.values for other in others])
    errors, passed = [], []
    for phases in CASES.values():
        found = [_planned(mean, own, limit, phases, shown), _planned(weighted, own, limit, phases, shown)]
        for predicted in (*found, _conditioned(promp, own, phases, shown)):
            errors.append(float(np.sqrt(np.mean((predicted.positions - shown.values) ** 2))))
            passed.append(bool((np.abs(predicted.velocities) > (1 + ROUNDING) * limit).any()))
    return errors, passed


def learned(recording: Recording, together: Several | None = None) -> Primitive:
    """The primitive of a recording, with positions weighted by the spread of several recordings."""
    return learn(Demonstration(recording.times, recording.values), spread=together and together.weighting().T)


def _planned(
    mean: Primitive, own: Primitive, limit: np.ndarray, phases: tuple[float, ...], shown: Recording
) -> Predicted:
    free, ends = np.full(2, np.nan), ((own.start, mean.start), (own.goal, mean.goal))
    start, goal = (Boundary(at.positions, np.clip(moving.velocities, -limit, limit), free) for at, moving in ends)
    none = Limits.unlimited(2)
    limits = Limits(none.positions, limit * (1 + ROUNDING / 2), none.accelerations, none.jerks)
    given = tuple(Waypoint(s * DURATION, own.positions(np.array([s]))[0], free) for s in phases)
    made: Plan = plan(mean, MotionRequest(start, goal, DURATION, limits, waypoints=given, tail="coast"))
    samples = made.sample(shown.times)
    return Predicted(samples.positions, samples.velocities)


def _conditioned(promp: ProMP, own: Primitive, phases: tuple[float, ...], shown: Recording) -> Predicted:
    for s in (0.0, 1.0, *phases):
        promp = promp.condition_position(own.positions(np.array([s]))[0], 1e-8 * np.eye(2), s, 1.0)  # type: ignore[arg-type]
    s = (shown.times - shown.times[0]) / DURATION
    return Predicted(promp.mean_trajectory(s), promp.mean_velocities(s) / DURATION)


if __name__ == "__main__":
    sys.exit(tyro.cli(main))
