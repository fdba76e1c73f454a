"""`volley robot`: import a model file and check the robot's description."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text
from tyro.conf import OmitSubcommandPrefixes, Positional, arg, subcommand

from robot.checking.checks import check_robot, cost_finding, measure_cost
from robot.checking.subject import Finding
from robot.clearance import Clearance
from robot.description import RobotConfig, load_robot
from robot.importing.arm import import_robot
from robot.importing.document import DECIDE, open_values
from robot.schema import RobotError
from tools.shell.console import ShellConsole
from tools.shell.flags import Identifier, Source
from tools.shell.shell import UsageError
from tools.shell.tables import joint_table

STYLES = {"unusable": "bold red", "warning": "yellow", "note": "dim"}
UNUSABLE = 1
LINE = re.compile(r"^(?:# )?(\w+)\s*=\s*(.*?[\]}\"\d])\s+#\s*(.+)$", re.MULTILINE)
"""A line of the TOML with a comment after its value."""


@dataclass(frozen=True, slots=True)
class Import:
    """Write the robot's TOML for the arm in an MJCF or URDF file, to standard output or with -o to a file.

    Attributes:
        model: An .xml or .urdf file.
        tool: Site or body at the end of the arm; by default the one with a telling name, else the last body.
        home: Keyframe of the home pose; by default `home`, else the first, else a pose without contact is computed.
        name: Name of the robot on the bus; by default the model's.
        output: TOML file to write, which must not exist. Its `model` path is relative if the model is in or below its
            directory.
    """

    model: Source
    tool: Identifier = None
    home: Identifier = None
    name: Identifier = None
    output: Annotated[Path | None, arg(aliases=["-o"], metavar="FILE", help_behavior_hint="")] = None


@dataclass(frozen=True, slots=True)
class Check:
    """List a robot's faults, each with its cure, and print its values with their origin.

    Exit status: 0, also with warnings; 1 if the arm cannot be driven; 2 if the file cannot be read.

    Attributes:
        config: The robot's TOML.
    """

    config: Positional[Annotated[Path, arg(metavar="FILE")]]


def robot(
    command: Annotated[
        Annotated[Import, subcommand("import")] | Annotated[Check, subcommand("check")],
        arg(name=""),
        OmitSubcommandPrefixes,
    ],
) -> int:
    """Set up your own robot: import its model, check its description."""
    try:
        return _import(command) if isinstance(command, Import) else _check(command.config)
    except RobotError as error:
        raise UsageError(str(error)) from None


def _import(command: Import) -> int:
    out = command.output
    if out is not None and out.exists():
        raise UsageError(f"{out} exists already; remove it, or name another file with -o")
    imported = import_robot(command.model, out, command.tool, command.home, command.name)
    notes = ShellConsole(stderr=True, soft_wrap=True, highlight=False)
    for note in imported.notes:
        notes.print(Text(note, "yellow"))
    if out is None:
        print(imported.text, end="")
        return 0
    try:
        out.write_text(imported.text)
    except OSError as error:
        raise UsageError(f"{out} cannot be written: {error.strerror}") from None
    print(f"wrote {out}; next: volley robot check {out}, then volley up --robot-config {out}")
    return 0


def _check(path: Path) -> int:
    config = load_robot(path)
    model = config.load_model()
    pairs = Finding("note", str(Clearance(config, model)))
    findings = [*check_robot(config, model), pairs, cost_finding(config, measure_cost(config, model))]
    console = ShellConsole(soft_wrap=True, highlight=False)
    console.print(_values(config), _origins(path.read_text()), *map(_sentence, findings), sep="\n")
    if undecided := open_values(path.read_text()):
        console.print(f"to decide, marked {DECIDE}: {', '.join(undecided)}")
    worst = findings[0].level
    console.print(Text({"unusable": "the arm cannot be driven like this"}.get(worst, "the arm can be started")))
    return UNUSABLE if worst == "unusable" else 0


def _values(config: RobotConfig) -> RenderableType:
    limits = config.limits
    columns: Sequence[tuple[str, Sequence[object]]] = [
        ("home [rad]", config.home.tolist()),
        ("range [rad]", [tuple(pair) for pair in limits.positions.tolist()]),
        *(
            (header, [float(value) if np.isfinite(value) else None for value in values])
            for header, values in (
                ("torque [N·m]", config.torques),
                ("velocity [rad/s]", limits.velocities),
                ("acceleration [rad/s²]", limits.accelerations),
                ("jerk [rad/s³]", limits.jerks),
            )
        ),
    ]
    title = f"{config.name}: {config.mjcf_path.name}, tool {config.tool.body or config.tool.site}"
    return joint_table(config.joint_names, columns, title)


def _origins(text: str) -> RenderableType:
    """Return the values of a TOML that have a comment with their origin, without vectors, which the table shows."""
    made = Table(box=None, pad_edge=False, show_header=False)
    for key, value, origin in LINE.findall(text):
        made.add_row(key, Text("" if "," in value else value), Text(origin, "dim"))
    return made


def _sentence(finding: Finding) -> Text:
    return Text.assemble((f"{finding.level}: ", STYLES[finding.level]), finding.sentence)
