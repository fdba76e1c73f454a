"""`python -m tools.drill`: cause every fault, measure the reactions, and print which bounds held."""

import sys
import tempfile
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from robot.schema import RobotError
from robot.shipped import DEFAULT_ROBOT_CONFIG
from services.common.cli import MISUSED, Options
from services.common.signals import end_like_ctrl_c
from tools.drill.harness.lab import Lab
from tools.drill.report import listing, save, table, write_markdown
from tools.drill.run import run_scenario
from tools.drill.scenario import Scenario, ScenarioOutcome
from tools.drill.table import select


@dataclass(frozen=True, slots=True)
class Flags:
    """Cause faults, measure the reactions, and compare them with their bounds.

    The router of each robot cell listens on a free port.

    Attributes:
        robot: Name of the robot on the bus; by default the one in the robot config.
        robot_config: TOML description of the robot; its library must contain the forehand.
        loop_core: Core that sim and controller share; by default the last one.
        only: Scenario to run, repeatable; by default all.
        list: Print the scenarios and their bounds, and exit.
        long: Soak for an hour and fuzz with 100,000 messages, instead of ten minutes and 5,000.
        logs: Directory for the logs of the services; by default they are deleted at the end.
        json: File for the measurements; it keeps those of other scenarios.
        markdown: Page whose table is generated from the JSON file.
    """

    robot: str | None = None
    robot_config: Path = DEFAULT_ROBOT_CONFIG
    loop_core: int | None = None
    only: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    list: bool = False
    long: bool = False
    logs: Path | None = None
    json: Path | None = None
    markdown: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None


def main() -> int:
    """Run the chosen scenarios, print and save the outcomes; return 0 if every bound held, 1 if not, 130 on Ctrl-C."""
    flags = tyro.cli(Flags)
    console = Console()
    end_like_ctrl_c()
    try:
        scenarios = select(flags.only)
    except KeyError as error:
        console.print(f"volley: {error.args[0]}", highlight=False)
        return MISUSED
    if flags.list:
        console.print(listing(scenarios))
        return 0
    outcomes: list[ScenarioOutcome] = []
    interrupted = False
    try:
        for outcome in drill(scenarios, flags, console):
            outcomes.append(outcome)  # noqa: PERF402 -- after an interruption the finished outcomes must remain
    except RobotError as error:
        console.print(f"volley: {error}", highlight=False)
        return MISUSED
    except KeyboardInterrupt:
        interrupted = True
    console.print(table(outcomes))
    if flags.json:
        document = save(flags.json, outcomes)
        if flags.markdown:
            write_markdown(flags.markdown, document)
    if interrupted:
        console.print(f"interrupted after {len(outcomes)} of {len(scenarios)} scenarios")
        return 130
    failed = [outcome.scenario.name for outcome in outcomes if not outcome.held]
    console.print(f"failed: {', '.join(failed)}" if failed else f"every bound held; scenarios: {len(outcomes)}")
    return 1 if failed else 0


def drill(scenarios: list[Scenario], flags: Flags, console: Console) -> Iterator[ScenarioOutcome]:
    """Run the scenarios with a progress bar; yield each outcome at once, so that an interruption loses only one."""
    columns = SpinnerColumn(), BarColumn(20), TextColumn("{task.description}"), TimeElapsedColumn()
    options = Options(flags.robot, flags.robot_config, loop_core=flags.loop_core)
    with (
        nullcontext(flags.logs) if flags.logs else tempfile.TemporaryDirectory(prefix="volley-drill-") as folder,
        Progress(*columns, console=console, transient=True) as progress,
        Lab(options, Path(folder), flags.long) as lab,
    ):
        task = progress.add_task("", total=len(scenarios))
        for scenario in scenarios:
            progress.update(task, description=f"{scenario.name}: {scenario.fault}")
            lab.progress = lambda activity, name=scenario.name: progress.update(task, description=f"{name}: {activity}")
            yield run_scenario(scenario, lab)
            progress.advance(task)


if __name__ == "__main__":
    sys.exit(main())
