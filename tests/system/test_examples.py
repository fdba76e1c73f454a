"""Every example runs and prints what it promises; `examples/README.md` lists them all."""

import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from harness import SERVICES, Stack, running

from client import connect

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
README = (EXAMPLES / "README.md").read_text()
ELSEWHERE = {"stand_in_driver"}
"""Tested as a robot side, with the contract tests of the simulated one."""
PRINTED = {
    "strike": [
        "at all times: True",
        "succeeded: ",
        r"the arm was \de-\d\d rad off",
        "refused, infeasible: ",
        "it takes 0.",
    ],
    "learn_csv": [
        "learned from-csv: 1.000 s",
        r"samples: \d\.?\d*e-\d\d rad",
        "played: succeeded",
        "library: forehand$",
    ],
    "waypoints": ["^with it: joint 1 at -0.8000 rad", "^succeeded$"],
    "correct": [
        "at phase 0.2",
        "at phase 0.4",
        "first goal was preempted, the last one succeeded",
        r"off by \de-\d\d rad",
    ],
    "lease": ["bob is refused, not_holder: ", "before her motion: canceled", "bob's goal is taken: succeeded"],
    "follow": [r" s  tracking  off the reference by", r"^succeeded after a peak error of \d\.\de-\d\d rad"],
    "qp_beside_dmp": [
        "^to its own end:",
        "^  qp .*certified$",
        "^  dmp .*held at its samples$",
        "^  dmp .*refused, limit: ",
    ],
    "bare_zenoh": [r"^goal \w+ hits 1\.000 s after", "^succeeded ", "^racket touches ball|^ball touches racket"],
}


@contextmanager
def passing_time(stack: Stack) -> Iterator[None]:
    """Let the stepped clock run for the length of the block, so that nothing depends on this machine's pace."""
    stopping = threading.Event()

    def step() -> None:
        with connect(stack.endpoint) as arm:
            while not stopping.wait(0.01):
                arm.step(20)

    thread = threading.Thread(target=step)
    thread.start()
    try:
        yield
    finally:
        stopping.set()
        thread.join()


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Services whose plans begin far enough ahead for a busy machine."""
    with running(tmp_path_factory.mktemp("services"), lead=0.3) as stack:
        yield stack


def run(name: str, *arguments: str) -> str:
    """Run an example as a user does and return what it printed."""
    line = [sys.executable, str(EXAMPLES / f"{name}.py"), *arguments]
    done = subprocess.run(line, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def check(printed: str, patterns: list[str]) -> None:
    """Check that every pattern is found in what was printed."""
    missing = [pattern for pattern in patterns if not re.search(pattern, printed, re.MULTILINE)]
    assert not missing, f"{missing} in\n{printed}"


@pytest.mark.parametrize("name", PRINTED)
def test_it_does_what_it_says(name: str, stack: Stack):
    with passing_time(stack):
        check(run(name, stack.endpoint), PRINTED[name])


def test_a_plan_needs_no_robot():
    check(run("plan_offline"), [r"ends at \[ 0\.9 -0\.1\] rad", "shaped by the limit on the", "^refused: .* works$"])


def test_a_trace_is_read(tmp_path: Path):
    file = tmp_path / "strike.rrd"
    with running(tmp_path, names=(*SERVICES, "recorder"), record=file) as stack, connect(stack.endpoint) as arm:
        stack.reset()
        goal = arm.goal("forehand")
        for _ in range(15):
            arm.step(100)
        assert goal.wait().outcome == "succeeded"
    check(run("read_trace", str(file)), [r"^joint_1: 1\d\d\d ticks, -1\.0\d\d to 0\.\d* rad, error \d", "succeeded"])


def test_the_readme_lists_every_example_and_each_is_tested():
    found = {file.stem for file in EXAMPLES.glob("*.py")} - {"__init__"}
    assert set(re.findall(r"^\| \[(\w+)\.py\]\(\1\.py\)", README, re.MULTILINE)) == found
    assert found - ELSEWHERE == {*PRINTED, "plan_offline", "read_trace"}


@pytest.mark.parametrize("file", sorted(EXAMPLES.glob("[a-z]*.py")), ids=lambda file: file.stem)
def test_it_is_short_and_says_how_to_run_it(file: Path):
    text = file.read_text()
    assert 30 <= len(text.splitlines()) <= 80
    assert f"    python examples/{file.name}" in text
