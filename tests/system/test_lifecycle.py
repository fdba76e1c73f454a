"""Services that start late, end early, are started twice, are killed and return."""

import contextlib
import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from harness import ROBOT, SERVICES, Stack, joined, wait_for

from protocol import messages as m
from protocol import topics
from protocol.codec import matrix
from protocol.errors import NoAnswer, Refusal
from services.common.cli import Options, free_endpoint
from services.common.realtime import split_cores
from services.common.supervisor import Supervisor, command_lines
from tests.cores import LOOP_CORE
from tools.demo.strikes import goal

HOME = ROBOT.home.tolist()


def lines_for(endpoint: str, tmp_path: Path) -> dict[str, list[str]]:
    """Return the command lines of services on the stepped clock."""
    return command_lines(
        Options(listen=(endpoint,), loop_core=LOOP_CORE), {"clock": "stepped", "library": tmp_path / "library"}
    )


def test_services_end_and_start_in_any_order(stack: Stack, tmp_path: Path):
    """SIGTERM ends every service with status 0: if the sim (the router) ends first, last, or was never there."""
    terminate(stack, SERVICES)
    began = time.time()
    for name in ("controller", "planner"):
        stack.services.start(name)
        wait_for(lambda name=name: stack.processes.logged_at(name, "waiting", began), f"the {name} to find no router")
    assert stack.services.ended() == {"sim": 0}
    stack.start_again("sim")
    stack.reset()
    reply = stack.goal(primitive="forehand", positions=HOME, duration=0.4)
    assert reply.start_time == pytest.approx(0.020, abs=1e-12)
    assert stack.finish(reply).outcome == "succeeded"
    terminate(stack, tuple(reversed(SERVICES)))
    for name in ("planner", "controller"):
        process = subprocess.Popen(lines_for(free_endpoint(), tmp_path)[name], stderr=subprocess.PIPE, text=True)
        assert process.stderr is not None
        assert any("waiting" in line for line in process.stderr)
        process.terminate()
        process.communicate()
        assert process.returncode == 0, name


def terminate(stack: Stack, order: tuple[str, ...]) -> None:
    """End the services one after another."""
    for name in order:
        process = stack.services.running[name]
        process.terminate()
        assert process.wait() == 0, name


LOOPS, OTHERS = split_cores(LOOP_CORE)


@pytest.mark.skipif(LOOPS == OTHERS, reason="there is one core, or only some were given to this process")
def test_sim_and_controller_share_a_core(stack: Stack):
    """Sim and controller run on the loops' core, and so do the Zenoh threads that run several times a tick.

    The planner and the threads that handle requests run elsewhere.
    """
    for name, process in stack.services.running.items():
        threads = threads_of(process.pid)
        _, main_cores = threads.pop(process.pid)
        of_zenoh = [cores for comm, cores in threads.values() if re.fullmatch(r"(rx|tx|net|app)-\d+", comm)]
        assert of_zenoh
        kept = OTHERS if name == "planner" else LOOPS
        assert [cores for cores in (main_cores, *of_zenoh) if cores != kept] == [], name
        assert OTHERS in [cores for comm, cores in threads.values() if comm.startswith("python")], name


def threads_of(pid: int) -> dict[int, tuple[str, set[int]]]:
    """Return the name and cores of each thread of a process; a thread that ends meanwhile is left out."""
    found = {}
    for task in Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            number = int(task.name)
            found[number] = (task / "comm").read_text().strip(), os.sched_getaffinity(number)
    return found


@pytest.mark.parametrize("name", SERVICES)
def test_a_second_service_ends_with_status_3(stack: Stack, tmp_path: Path, name: str):
    """The second instance logs why it ends; the first one goes on."""
    line = lines_for(stack.endpoint, tmp_path)[name]
    second = subprocess.run(line, capture_output=True, text=True, check=False)
    assert second.returncode == 3, second.stderr
    assert f"another {name} serves robot arm" in second.stderr
    assert "Traceback" not in second.stderr
    assert stack.services.ended() == {}
    assert stack.status().mode == "holding"


def test_a_planner_alone_plans(tmp_path: Path):
    """Without other services a planner hosts the bus and plans from home; it refuses goals that are to be played."""
    endpoint = free_endpoint()
    line = [sys.executable, "-m", "services.planner", "--listen", endpoint, "--library", str(tmp_path / "library")]
    with Supervisor({"planner": line}) as supervisor, joined(endpoint) as bus:
        supervisor.wait_ready(bus)
        stack = Stack(supervisor, bus, endpoint, tmp_path, ROBOT, True)
        reply = stack.goal(primitive="forehand", positions=HOME, plan_only=True, include_trajectory=True)
        assert reply.trajectory is not None
        positions = matrix(reply.trajectory.positions, reply.trajectory.count, len(HOME), "positions")
        assert positions[0] == pytest.approx(HOME, abs=1e-12)
        refusal = stack.refused_goal(primitive="forehand", positions=HOME, goal_id="alone")
        assert (refusal.code, refusal.detail) == ("unavailable", {"service": "controller", "goal_id": "alone"})
        process = supervisor.running["planner"]
    assert process.returncode == 0


def test_a_motion_outlives_its_planner(stack: Stack):
    """The motion is played to its end; a new planner knows the learned primitives and refuses the goal's id again."""
    samples = [[0.3 * math.sin(k / 100), *HOME[1:]] for k in range(200)]
    stack.bus.ask(topics.LEARN, m.Learn(name="nod", positions=samples, rate=200.0))
    before = stack.bus.ask(topics.PRIMITIVES, m.Empty())
    reply = stack.bus.ask(topics.GOAL, goal(goal_id="orphan"))
    stack.step(300)
    stack.kill("planner")
    assert stack.finish(reply).outcome == "succeeded"
    with pytest.raises(NoAnswer):
        stack.bus.ask(topics.PRIMITIVES, m.Empty(), timeout=2.0)
    stack.start_again("planner")
    assert stack.bus.ask(topics.PRIMITIVES, m.Empty()) == before
    assert stack.refused_goal(primitive="nod", positions=HOME, goal_id="orphan").code == "duplicate"
    assert stack.finish(stack.goal(primitive="nod", positions=HOME)).outcome == "succeeded"


def test_a_restarted_sim_is_detected(stack: Stack):
    """The router ends and returns with the sim; the goal is aborted, and new goals succeed."""
    reply = stack.bus.ask(topics.GOAL, goal())
    stack.step(300)
    stack.processes.signal("sim", signal.SIGKILL)
    stack.services.start("sim")
    stack.services.wait_ready(stack.bus)
    wait_for(lambda: aborted(stack, reply.goal_id), "the controller to notice the new run")
    stack.reset()
    assert stack.status().mode == "holding"
    back = stack.goal(primitive="forehand", positions=HOME, duration=0.5)
    assert back.start_time == pytest.approx(0.020, abs=1e-12)
    assert stack.finish(back).outcome == "succeeded"
    assert stack.end_tick(back) < stack.tick


def aborted(stack: Stack, goal_id: str) -> bool:
    """Return whether the controller reports the goal as aborted."""
    try:
        return stack.result(goal_id).outcome == "aborted"
    except (NoAnswer, Refusal):
        return False
