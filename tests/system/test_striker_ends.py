"""A striker or planner is killed in mid-swing, on the paced clock: the arm ends at rest inside its limits."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness import ROBOT, SERVICES, Stack, running

from protocol import messages as m
from protocol import topics
from robot.striking.launcher import Launcher
from tools.drill.harness.waiting import wait_for
from tools.rally.limit_monitor import LimitMonitor

PACE = 0.5


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Start all services and a striker."""
    folder = tmp_path_factory.mktemp("striker")
    flags = {"learned": folder / "learned.json", "pace": PACE}
    with running(folder, names=(*SERVICES, "striker"), clock="paced", **flags) as stack:
        yield stack


def swinging(stack: Stack, seed: int) -> m.Strike:
    """Order strikes, throw a ball, and return the striker's message that a hit is planned."""
    stack.drain(topics.STATUS)  # drop those of earlier strikes
    stack.bus.ask(topics.STRIKE, m.StrikeRequest(target=(4.5, 0.0, 0.0)))
    stack.wait_status(lambda status: status.mode == "tracking", "the arm to go to its ready pose")
    wait_for(lambda: stack.mode() == "holding", "the arm to reach its ready pose")
    launch = Launcher(ROBOT, seed).next()
    stack.drain(topics.STRIKES)  # drop those of the ball before
    stack.bus.ask(topics.SIM_BALL, m.Throw(position=launch.position, velocity=launch.velocity))
    while (said := stack.next(topics.STRIKES)).phase not in ("planned", "missed"):
        pass
    assert said.phase == "planned", said.reason
    return said


@pytest.mark.realtime
@pytest.mark.parametrize("name", ["striker", "planner"])
def test_a_process_that_is_killed_in_mid_swing_leaves_an_arm_that_ends_at_rest(stack: Stack, name: str):
    watch = LimitMonitor(stack.bus, ROBOT)
    stack.listen(topics.CONTACT)
    said = swinging(stack, 0)
    stack.kill(name)
    if name == "planner":
        while not (said.phase == "refused" and "planner" in said.reason):
            said = stack.next(topics.STRIKES)
    wait_for(lambda: stack.mode() == "holding", "the arm to be at rest")
    stack.processes.start(name)
    stack.services.wait_ready(stack.bus)
    watch.read()
    findings = watch.check((0.0,))  # limits may be exceeded when the ball hits the arm
    assert findings.ticks > 100
    assert findings.violations == 0, findings
    assert stack.status().fault is None
    touched = [contact.bodies for contact in stack.drain(topics.CONTACT)]
    assert all("ball" in bodies for bodies in touched), touched


@pytest.mark.realtime
def test_a_second_striker_ends_with_status_3(stack: Stack, tmp_path: Path):
    line = [sys.executable, "-m", "services.striker", "--connect", stack.endpoint, "--learned", tmp_path / "x.json"]
    second = subprocess.run(line, capture_output=True, text=True, check=False)
    assert second.returncode == 3, second.stderr
    assert "another striker serves robot arm" in second.stderr
    assert "Traceback" not in second.stderr
