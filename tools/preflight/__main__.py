"""`python -m tools.preflight`: check this machine for a 1 kHz loop; exit status 1 if it cannot run one."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import tyro
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from services.common import realtime
from services.common.cli import MISUSED
from tools.preflight.facts import Fact, read_facts
from tools.preflight.verdict import Sample, measure, promise

SHORTEST_S, LONGEST_S = 0.1, 3600.0
"""Bounds of `seconds`."""


@dataclass(frozen=True, slots=True)
class Flags:
    """Measure whether this machine can run a 1 kHz loop.

    Attributes:
        seconds: Duration of the measurement.
    """

    seconds: float = 2.0


def main() -> int:
    """Request real-time scheduling as the services do, read the facts, run the loop, print the verdict."""
    flags = tyro.cli(Flags)
    if not SHORTEST_S <= flags.seconds <= LONGEST_S:
        bounds = f"{SHORTEST_S:g} and {LONGEST_S:g}"
        print(f"preflight: seconds is {flags.seconds:g}; it must lie between {bounds}", file=sys.stderr)
        return MISUSED
    facts = read_facts(realtime.become_real_time(priority=50))
    loops, _ = realtime.split_cores(None)
    realtime.keep_to(loops)
    realtime.freeze_garbage()
    sample = measure(flags.seconds)
    fit, sentence = promise(sample, facts)
    console = Console()
    console.print(build_table(facts, sample))
    console.print(f"This machine promises {escape(sentence)}.", style="green" if fit else "red", highlight=False)
    return 0 if fit else 1


def build_table(facts: Sequence[Fact], sample: Sample) -> Table:
    """Return the facts and the sample as a table."""
    table = Table("", "found", "better", title="Preflight")
    for fact in facts:
        colour = {True: "green", False: "red", None: "yellow"}[fact.good]
        advice = "" if fact.good else fact.advice
        table.add_row(fact.name, f"[{colour}]{escape(fact.found)}[/{colour}]", escape(advice))
    late = f"p50 {sample.median_us:.0f}, p99 {sample.p99_us:.0f}, max {sample.max_us:.0f} µs late"
    colour = "red" if sample.missed else "yellow" if sample.late else "green"
    table.add_row("1 ms loop", f"[{colour}]{late}[/{colour}]", f"{sample.count} ticks, {sample.late} over 250 µs")
    return table


if __name__ == "__main__":
    sys.exit(main())
