"""`python -m experiments`: make the paper's figures, the table of numbers and the traces."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from experiments import errata, fig2, fig3, fig4, fig5, fig6, hitting, live, solver, table
from experiments.common import Outcome
from experiments.trace import write_trace

EXPERIMENTS: dict[str, Callable[[], Outcome]] = {
    "errata": errata.run,
    "hitting": hitting.run,
    "fig2": fig2.run,
    "fig3": fig3.run,
    "fig4": fig4.run,
    "fig5": fig5.run,
    "fig6": fig6.run,
    "solver": solver.run,
}


@dataclass(frozen=True, slots=True)
class Flags:
    """Make the paper's figures (docs/figures), numbers (experiments/results.json, docs/paper.md) and traces.

    Attributes:
        live: Play fig. 5 on the simulated arm too; without it the table keeps its numbers of that.
        out: Directory for the traces fig5.rrd (the arm) and paper.rrd (the curves).
    """

    live: bool = True
    out: Path = Path("out")


def main() -> None:
    """Run every experiment and write its outcome."""
    flags, console = tyro.cli(Flags), Console()
    todo = dict(EXPERIMENTS)
    if flags.live:
        todo["live"] = lambda: live.run(flags.out / "fig5.rrd")
    outcomes = run_all(todo, console)
    rows = [row for outcome in outcomes.values() for row in outcome.rows]
    if not flags.live:
        rows += [row for row in table.read_results() if row.name.startswith("live.")]
    table.write_results(rows)
    page = table.PAGE.read_text(encoding="utf-8")
    table.PAGE.write_text(table.quote(page, table.read_results()), encoding="utf-8")
    table.FIGURES.mkdir(exist_ok=True)
    for name, outcome in outcomes.items():
        if outcome.figure is not None:
            outcome.figure.savefig(table.FIGURES / f"{name}.png", metadata={"Software": None})
    write_trace((curve for outcome in outcomes.values() for curve in outcome.curves), flags.out / "paper.rrd")
    console.print(f"{len(rows)} numbers in experiments/results.json, figures in docs/figures, quoted in docs/paper.md")
    console.print(f"traces: rerun {flags.out}/paper.rrd" + (f" {flags.out}/fig5.rrd" if flags.live else ""))


def run_all(todo: dict[str, Callable[[], Outcome]], console: Console) -> dict[str, Outcome]:
    """Run the experiments one after another, with a progress bar."""
    outcomes = {}
    with Progress(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console) as progress:
        for name, run in todo.items():
            shown = progress.add_task(name, total=1)
            outcomes[name] = run()
            progress.advance(shown)
    return outcomes


if __name__ == "__main__":
    main()
