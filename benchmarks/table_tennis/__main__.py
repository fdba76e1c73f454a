"""`python -m benchmarks.table_tennis`: return balls of fancy_gym's table tennis with the planner, without training."""

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import tyro

from benchmarks.table_tennis.balls import HEADING, Ball, rows
from benchmarks.table_tennis.exit_status import exit_status_of
from benchmarks.table_tennis.player import Player
from benchmarks.table_tennis.resuming import ResumableRun, scratch_folder
from benchmarks.table_tennis.variants import VARIANTS, Variant

SIDE_BY_SIDE = ("calm", "calm-dmp", "calm-quintic", "noise", "noise-once", "noise-dmp", "noise-quintic")
"""The planner and the methods for comparison, on the same balls."""


@dataclass(frozen=True)
class Arguments:
    """Return balls of fancy_gym's table tennis.

    variants: names. balls: of each. seed: of the first ball; later balls have the following seeds. json: file to which
    each ball is appended as a line; balls that it contains are not played again, so the same command continues a run.
    seconds: begin no further ball after this time. demonstration: a recorded strike of a WAM, a CSV file with a line of
    names, then time and seven positions, s and rad; without it a quintic is imitated. verbose: print a line for each
    failed ball.
    """

    variants: tuple[str, ...] = SIDE_BY_SIDE
    balls: int = 100
    seed: int = 0
    json: Path | None = None
    seconds: float = float("inf")
    demonstration: Path | None = None
    verbose: bool = False


def run(variant: Variant, arguments: Arguments, deadline: float) -> dict[int, Ball]:
    """Play the remaining balls of a variant; return all balls by their seeds."""
    name = variant.name + ("-recorded" if arguments.demonstration else "")
    resumed = ResumableRun(name, range(arguments.seed, arguments.seed + arguments.balls), arguments.json)
    if resumed.remaining and time.monotonic() <= deadline:
        player = Player(variant, scratch_folder(variant.name), arguments.demonstration)
        for seed, ball in resumed.play(player.play):
            if arguments.verbose and not ball.success:
                print(f"  {seed}: {ball}", file=sys.stderr)
            if time.monotonic() > deadline:
                break
    if resumed.balls:
        print("\n".join(rows(name, resumed.balls, variant.learns)), flush=True)
    return resumed.balls


def play(arguments: Arguments) -> None:
    """Play, and print a table.

    Raises:
        ValueError: a variant is unknown, or the results file cannot be read.
    """
    unknown = [name for name in arguments.variants if name not in VARIANTS]
    if unknown:
        raise ValueError(f"variants: {unknown[0]!r} is unknown; choose from {', '.join(VARIANTS)}")
    deadline = time.monotonic() + arguments.seconds
    print(HEADING)
    for name in arguments.variants:
        run(VARIANTS[name], arguments, deadline)


if __name__ == "__main__":
    flags = tyro.cli(Arguments)
    sys.exit(exit_status_of(lambda: play(flags)))
