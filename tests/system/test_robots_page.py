"""The commands of docs/robots.md bring each of its arms from a model file to a result and a picture."""

import contextlib
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from services.common.cell import running_cell
from services.common.cli import Options, free_endpoint
from tests import models
from tests.cores import LOOP_CORE
from tools.shell.__main__ import main

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8")
ARMS = {"UR5e": models.UR5E, "Panda": models.PANDA, "iiwa14": models.IIWA14, "SO-101": models.SO101}
SERVICES = ["sim", "planner", "controller"]
PICTURED = "UR5e"
"""The only arm with a recorder and a picture: the viewer takes 5 s, and the picture works alike for all arms."""
DRIVERS = Path("/usr/share/vulkan/icd.d")
"""Without a graphics driver the picture is left out."""
LATE_TRIES = 3
"""On a busy machine a plan may come too late; it is refused and moves nothing."""
HIT = 1e-4
"""Largest error at the hit on any joint, rad."""


def commands(arm: str) -> list[list[str]]:
    """Return the commands of the arm's block."""
    (block,) = re.findall(rf"### {arm}\n\n```sh\n(.*?)```", PAGE, re.DOTALL)
    return [shlex.split(line.replace("$VOLLEY", str(ROOT))) for line in block.splitlines()]


def test_the_page_has_the_arms() -> None:
    assert re.findall(r"### (.+)\n\n```sh", PAGE) == list(ARMS)


@pytest.mark.parametrize("arm", ARMS)
def test_an_arm_from_its_model_to_a_picture(
    arm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every command of the block succeeds; the tool's goal is hit, with its velocity."""
    for file in ARMS[arm].parent.iterdir():
        (tmp_path / file.name).symlink_to(file)
    monkeypatch.chdir(tmp_path)
    endpoint = free_endpoint()
    said: dict[str, str] = {}
    with contextlib.ExitStack() as stack:
        for words in commands(arm):
            match words:
                case ["volley", "up", "--robot-config", config, "--record", trace]:
                    options = Options(robot_config=tmp_path / config, listen=(endpoint,), loop_core=LOOP_CORE)
                    names = [*SERVICES, "recorder"] if arm == PICTURED else SERVICES
                    flags = {"record": tmp_path / trace}
                    stack.enter_context(running_cell(options, flags, names, quiet=True))
                case ["volley", "robot", *_]:
                    assert main(words[1:]) == 0
                case ["volley", *_]:
                    print(output_of([*words[1:], "--connect", endpoint, "--json"], capsys))
                case ["python", "-m", "tools.screenshot", trace, picture]:
                    stack.close()  # the trace is complete
                    if arm == PICTURED and DRIVERS.exists():
                        run(words)
                        assert (tmp_path / picture).stat().st_size > 10_000
                case ["python", *_]:
                    run(words)
                case _:
                    pytest.fail(f"the page has a line that is no command: {words}")
            said[words[1]] = capsys.readouterr().out
    result = json.loads(said["result"])
    assert result["outcome"] == "succeeded"
    assert max(map(abs, result["hit"]["position_error"])) < HIT
    assert max(map(abs, result["hit"]["velocity_error"])) < 1e-3


def output_of(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Return what a command of `volley` prints, which succeeds; a goal that is planned too late is sent again."""
    for _ in range(LATE_TRIES):
        status, printed = main(words), capsys.readouterr()
        if status == 0:
            return printed.out
        assert '"code": "late"' in printed.err, printed.err
    return pytest.fail(f"late {LATE_TRIES} times: {words}")


def run(words: list[str]) -> None:
    """Run a command of Python in the present folder."""
    done = subprocess.run([sys.executable, *words[1:]], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
