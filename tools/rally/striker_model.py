"""The striker's description of the robot, optionally with errors of its parameters."""

import contextlib
import json
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from robot.schema import read_description
from tools.rally.flags import Flags


@contextlib.contextmanager
def striker_description(flags: Flags) -> Iterator[tuple[Path, Path]]:
    """Yield the striker's TOML of the robot, with the requested errors, and a temporary file for learned values."""
    original = flags.common.robot_config.resolve()
    with tempfile.TemporaryDirectory(prefix="volley-rally-") as folder:
        learned = Path(folder) / "learned.json"
        if not flags.drag_error and not flags.restitution_error:
            yield original, learned
            return
        description = read_description(original)
        wrong: dict[tuple[str, str], object] = {("", "model"): json.dumps(str(original.parent / description.model))}
        if description.ball:
            wrong["ball", "drag"] = description.ball.drag * (1 + flags.drag_error)
        if description.court:
            wrong["court", "restitution"] = description.court.restitution * (1 + flags.restitution_error)
        changed = Path(folder) / original.name
        changed.write_text(with_values(original.read_text(), wrong))
        yield changed, learned


def with_values(toml: str, values: Mapping[tuple[str, str], object]) -> str:
    """Return a TOML text with some values replaced; `values` maps (table, key) to the new value."""
    lines, section = [], ""
    for line in toml.splitlines():
        if line.startswith("["):
            section = line[1:].partition("]")[0]
        key = (section, line.partition("=")[0].strip())
        lines.append(f"{key[1]} = {values[key]}" if key in values else line)
    return "\n".join(lines) + "\n"
