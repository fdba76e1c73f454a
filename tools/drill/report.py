"""Write the drill's outcomes as a table on the screen, as JSON and as Markdown."""

import json
import os
import platform
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from services.common.realtime import may_be_real_time
from tools.drill.scenario import Bound, Scenario, ScenarioOutcome, Value, evaluate
from tools.drill.table import FAMILIES

BEGIN, END = "<!-- begin: python -m tools.drill -->", "<!-- end: python -m tools.drill -->"


def value_text(value: Value | None, unit: str = "") -> str:
    """Format a measurement: integers exactly, other numbers to three digits."""
    if value is None:
        return "not measured"
    shown = value if isinstance(value, str) else f"{value:d}" if isinstance(value, int) else f"{value:.3g}"
    return f"{shown} {unit}".strip()


def bound_text(bound: Bound) -> str:
    """Format a bound; empty if the measurement is only reported."""
    if bound.relation == "reported":
        return ""
    exact = bound.value if isinstance(bound.value, str) else f"{bound.value:.7g}"
    value = f"{exact} {bound.unit}".strip()
    return value if bound.relation == "=" else f"{bound.relation} {value}"


def failures(outcome: ScenarioOutcome) -> str:
    """Return the error of a scenario, or the measurements whose bounds failed."""
    failed = [reaction for reaction in outcome.reactions if not reaction.held]
    listed = ", ".join(f"{each.bound.reaction}: {value_text(each.measured, each.bound.unit)}" for each in failed)
    return outcome.error or listed


def table(outcomes: Sequence[ScenarioOutcome]) -> Table:
    """Return a table with a row for each reaction."""
    shown = Table(title="The drill", box=SIMPLE_HEAD, padding=(0, 1))
    for heading in ("fault", "reaction", "measured", "bound", ""):
        shown.add_column(heading, overflow="fold")
    for outcome in outcomes:
        fault = f"{outcome.scenario.name}: {outcome.scenario.fault}"
        fault += "".join(f"\nrepeated: {attempt}" for attempt in outcome.earlier_attempts)
        if outcome.error:
            shown.add_row(fault, outcome.error, "", "", Text("error", "bold red"))
            continue
        for reaction in outcome.reactions:
            held = Text("held", "green") if reaction.held else Text("failed", "bold red")
            bound = reaction.bound
            measured = value_text(reaction.measured, bound.unit)
            shown.add_row(fault, bound.reaction, measured, bound_text(bound), held)
            fault = ""
    return shown


def listing(scenarios: Iterable[Scenario]) -> Table:
    """Return a table of scenarios and their bounds."""
    shown = Table(box=SIMPLE_HEAD, padding=(0, 1))
    for heading in ("name", "clock", "fault", "bounds"):
        shown.add_column(heading, overflow="fold")
    for scenario in scenarios:
        bounds = "\n".join(f"{bound.reaction}: {bound_text(bound) or 'reported'}" for bound in scenario.bounds)
        shown.add_row(scenario.name, scenario.clock, scenario.fault, bounds)
    return shown


# --- files ------------------------------------------------------------------------------------------------


def machine() -> dict[str, str]:
    """Describe this machine, without its name."""
    return {
        "processor": _processor(),
        "cores": str(len(os.sched_getaffinity(0))),
        "kernel": f"{platform.system()} {platform.release().partition('-')[0]} {_preemption()}",
        "scheduler": "SCHED_FIFO" if may_be_real_time() else "SCHED_OTHER",
        "python": platform.python_version(),
    }


def save(path: Path, outcomes: Iterable[ScenarioOutcome]) -> dict[str, Any]:
    """Write outcomes into a JSON file, which keeps those of other scenarios; return the whole document."""
    rows = json.loads(path.read_text())["rows"] if path.exists() else {}
    rows.update((outcome.scenario.name, _row(outcome)) for outcome in outcomes)
    document = {"machine": machine(), "rows": rows}
    path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    return document


def write_markdown(path: Path, document: dict[str, Any]) -> None:
    """Replace the table between the marks of a Markdown page by that of a JSON document."""
    before, _, rest = path.read_text().partition(BEGIN)
    _, _, after = rest.partition(END)
    path.write_text(f"{before}{BEGIN}\n\n{markdown(document)}\n{END}{after}")


def markdown(document: dict[str, Any]) -> str:
    """Return the machine, and the tables of all measurements by family, as Markdown."""
    described = ", ".join(f"{name} {value}" for name, value in document["machine"].items())
    lines = [f"Measured on: {described}.", ""]
    for family, scenarios in FAMILIES.items():
        lines += [f"### {family}", "", "| fault | reaction measured | bound | |", "|---|---|---|---|"]
        lines += [_line(scenario, document["rows"].get(scenario.name)) for scenario in scenarios]
        lines.append("")
    return "\n".join(lines)


def _line(scenario: Scenario, row: dict[str, Any] | None) -> str:
    """Return a scenario's row of the table; `row` is None if the scenario was not measured."""
    bounds = "<br>".join(bound_text(bound) or "reported" for bound in scenario.bounds)
    if row is None:
        measured, held = "not measured", ""
    else:
        # A bound may have changed since the measurement.
        measurements = {r["reaction"]: r["measured"] for r in row["reactions"] if r["measured"] is not None}
        outcome = evaluate(scenario, measurements, row["seconds"], row["error"])
        listed = "<br>".join(f"{r.bound.reaction}: {value_text(r.measured, r.bound.unit)}" for r in outcome.reactions)
        earlier = "".join(f"<br>repeated: {attempt}" for attempt in row["earlier_attempts"])
        measured, held = (outcome.error or listed) + earlier, "held" if outcome.held else "**failed**"
    return f"| `{scenario.name}`: {scenario.fault} | {measured} | {bounds} | {held} |"


def _row(outcome: ScenarioOutcome) -> dict[str, Any]:
    return {
        "fault": outcome.scenario.fault,
        "clock": outcome.scenario.clock,
        "held": outcome.held,
        "error": outcome.error,
        "seconds": round(outcome.seconds, 1),
        "earlier_attempts": list(outcome.earlier_attempts),
        "reactions": [
            {
                "reaction": reaction.bound.reaction,
                "measured": reaction.measured,
                "relation": reaction.bound.relation,
                "bound": reaction.bound.value,
                "unit": reaction.bound.unit,
                "held": reaction.held,
            }
            for reaction in outcome.reactions
        ],
    }


def _processor() -> str:
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def _preemption() -> str:
    return next((word for word in platform.version().split() if word.startswith("PREEMPT")), "")
