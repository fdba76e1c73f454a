"""Every example runs and prints what it announces; `examples/README.md` lists them all."""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness import SERVICES, Stack, running, wait_for_controller

from client import connect

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
README = (EXAMPLES / "README.md").read_text()
ELSEWHERE = {"stand_in_driver", "record_wave", "rally"}
"""Tested with the contract tests of a robot side, by the commands of docs/robots.md, and in test_rally."""
PRINTED = {
    "strike": [
        "at all times: True",
        "^succeeded",
        r"the arm was \d\.\de-0[5-9] rad off",
        "refused, limit: ",
        "bound on the position is",
    ],
    "learn_csv": [
        "learned from-csv: 1.000 s",
        r"samples: \d\.?\d*e-\d\d rad",
        "played: succeeded",
        "library: forehand$",
    ],
    "waypoints": ["^with it: joint 1 at -0.8000 rad", "^succeeded$"],
    "tool_space": [
        r"^the joints end at \[",
        "^played: succeeded$",
        "behind it: succeeded$",
        "^refused, unreachable: tool: .* the arm does not reach there",
        r"^0\.8\d m nearer it can be: \[",
    ],
    "correct": [
        r"at phase 0\.\d\d: hits at 0\.09 rad",
        r"at phase 0\.\d\d: hits at 0\.11 rad",
        "first goal was preempted, the last one succeeded",
        r"off by \d\.\de-0[5-9] rad",
    ],
    "lease": ["bob is refused, not_holder: ", "before her motion: canceled", "bob's goal is taken: succeeded"],
    "follow": [r" s  tracking  off the reference by", r"^succeeded after a peak error of \d\.\de-\d\d rad"],
    "qp_beside_dmp": [
        "^to its own end:",
        "^  qp .*certified$",
        r"^  gaussian .* \d\.\d\d rad of room at its samples$",
        r"^  dmp .* -0\.1\d rad of room at its samples$",
    ],
    "bare_zenoh": [r"^goal \w+ hits 1\.000 s after", "^succeeded ", "^racket touches ball|^ball touches racket"],
}


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Start services on the default clock, which tolerates a busy machine."""
    with running(tmp_path_factory.mktemp("services"), clock="paced") as stack:
        yield stack


@pytest.fixture
def stack(services: Stack) -> Stack:
    """Return the services at the start of a new run; `Stack.reset` would need the stepped clock."""
    with connect(services.endpoint) as arm:
        arm.reset_sim()
    wait_for_controller(services)
    return services


def run(name: str, *arguments: str) -> str:
    """Run an example as a user does and return what it printed."""
    line = [sys.executable, str(EXAMPLES / f"{name}.py"), *arguments]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def check(printed: str, patterns: list[str]) -> None:
    """Check that every pattern is found in what was printed."""
    missing = [pattern for pattern in patterns if not re.search(pattern, printed, re.MULTILINE)]
    assert not missing, f"{missing} in\n{printed}"


@pytest.mark.parametrize("name", PRINTED)
def test_it_does_what_it_says(name: str, stack: Stack):
    check(run(name, stack.endpoint), PRINTED[name])


def test_a_plan_needs_no_robot():
    check(run("plan_offline"), [r"ends at \[ 0\.9 -0\.1\] rad", "shaped by the limit on the", "^refused: .* works$"])


def test_poses_of_a_tool_become_joint_positions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    check(run("tool_poses"), [r"^wrote circle\.npz: 201 postures, at most 0\.0\d+ rad from one to the next"])


def test_a_trace_is_read(tmp_path: Path):
    file = tmp_path / "strike.rrd"
    names = (*SERVICES, "recorder")
    with running(tmp_path, names, "paced", record=file) as stack, connect(stack.endpoint) as arm:
        assert arm.goal("forehand").wait().outcome == "succeeded"
    check(run("read_trace", str(file)), [r"^joint_1: \d+ ticks, -1\.0\d\d to 0\.\d* rad, error \d", "succeeded"])


def test_the_readme_lists_every_example_and_each_is_tested():
    found = {file.stem for file in EXAMPLES.glob("*.py")} - {"__init__"}
    assert set(re.findall(r"^\| \[(\w+)\.py\]\(\1\.py\)", README, re.MULTILINE)) == found
    assert found - ELSEWHERE == {*PRINTED, "plan_offline", "read_trace", "tool_poses"}


@pytest.mark.parametrize("file", sorted(EXAMPLES.glob("[a-z]*.py")), ids=lambda file: file.stem)
def test_it_is_short_and_says_how_to_run_it(file: Path):
    text = file.read_text()
    assert 30 <= len(text.splitlines()) <= 80
    assert f"    python examples/{file.name}" in text
