"""Clients that are killed, with and without a lease, and clients that compete for the arm."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import CLIENT, open_session
from protocol.errors import Refusal
from tools.drill.harness.cell import ACCEPTED, Cell
from tools.drill.harness.commanded import differing_commands
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import CellConfig
from tools.drill.harness.waiting import ScenarioError
from tools.drill.scenario import Measured, Scenario, at_most, exactly, none, timed

GOAL_ID = "followed"
LISTENERS = 4
STOPPED_S = 3e-3 * CLIENT.lease_ms


@contextmanager
def client(cell: Cell, *flags: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a client process that sends a slow motion of joint_1."""
    line = [sys.executable, "-m", "tools.shell", "goal", "forehand"]
    line += ["--connect", cell.endpoint, "--robot", cell.bus.robot]
    line += ["--positions", "0.5", *map(str, cell.home[1:]), "--duration", "3", "--goal-id", GOAL_ID, *flags]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def kill_client(lab: Lab, lease: bool) -> Measured:
    """Kill a client in the middle of its motion."""
    with lab.cell(CellConfig(clock="realtime")) as cell:
        cell.listen(topics.STATUS)
        with client(cell, "--wait", *(["--lease"] if lease else [])) as process:
            cell.wait_status(lambda status: status.mode == "tracking", "the start of the client's motion")
            time.sleep(0.7)
            if process.poll() is not None:
                raise ScenarioError("the client ended before it could be killed")
            process.kill()
            stop_s = cell.wait_status(lambda status: status.mode == "stopping", "the stop", 5.0) if lease else 0.0
        cell.wait_ended(GOAL_ID)
        measured: Measured = {"outcome of the goal": cell.result(GOAL_ID).outcome, "mode afterwards": cell.mode()}
        return {**measured, "time until the stop begins": 1e3 * stop_s} if lease else measured


@contextmanager
def listeners(cell: Cell, count: int) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Run processes that subscribe to all publications."""
    line = [sys.executable, "-m", "tools.drill.harness.listener", cell.endpoint, cell.bus.robot]
    with ExitStack() as running:
        processes = []
        for _ in range(count):
            processes.append(running.enter_context(subprocess.Popen(line, stdout=subprocess.PIPE)))
            running.callback(processes[-1].kill)
        for process in processes:
            if process.stdout is None or not process.stdout.readline():
                raise ScenarioError("a listener could not join the bus")
        yield processes


def stop_listeners(lab: Lab) -> Measured:
    """Stop processes that subscribe to all publications, for the duration of a motion."""
    with lab.cell(CellConfig(clock="realtime")) as cell, listeners(cell, LISTENERS) as stopped:
        cell.recover()
        reply = cell.move_aside(STOPPED_S)
        for process in stopped:
            process.send_signal(signal.SIGSTOP)
        return {"outcome of the goal": cell.finish(reply).outcome, "mode afterwards": cell.mode()}


def compete(lab: Lab) -> Measured:
    """Send goals from three clients, of which the first holds a lease."""
    cell = lab.shared_cell()
    with Bus(open_session([cell.endpoint]), cell.bus.robot) as alice:
        alice.announce("client/alice")
        leased = cell.strike(client_id="alice", lease=True)
        plan = cell.plan_of(leased)
        cell.step_to(cell.ticks(leased.start_time) + 100)
        refusals = [refusal(cell, client_id="bob"), refusal(cell), refusal(cell, client_id="bob", lease=True)]
        cell.step_to(cell.end_tick(leased) + 2)
        differing = differing_commands(cell.commands(), plan, cell.config)
        again = cell.strike(client_id="alice", lease=True)
        cell.step_to(cell.ticks(again.start_time) + 300)
        canceled = cell.bus.ask(topics.CANCEL, m.Cancel())
        cell.step_to(cell.ticks(canceled.stop_time) + 2)
        return {
            "goals accepted from other clients": sum(code != "not_holder" for code, _ in refusals),
            "refusals that do not name the lease holder": sum(holder != "alice" for _, holder in refusals),
            "commands that differ from the plan": differing,
            "outcome of the holder's goal": cell.result(leased.goal_id).outcome,
            "outcome of the holder's second goal, canceled by another client": cell.result(again.goal_id).outcome,
            "outcome of another client's goal afterwards": cell.finish(cell.goal(client_id="bob")).outcome,
        }


def refusal(cell: Cell, **fields: object) -> tuple[str, str]:
    """Send a goal that must be refused; return the code and the lease holder of the refusal."""
    try:
        cell.goal(**fields)
    except Refusal as refused:
        return refused.code, str(refused.detail.get("client_id"))
    return ACCEPTED, ""


SUCCEEDS = timed(exactly("outcome of the goal", "succeeded"))
HOLDS = timed(exactly("mode afterwards", "holding"))

SCENARIOS = (
    Scenario(
        "client-killed-lease",
        "client with a lease killed",
        (
            timed(at_most("time until the stop begins", 300.0, "ms")),
            timed(exactly("outcome of the goal", "canceled")),
            HOLDS,
        ),
        lambda lab: kill_client(lab, lease=True),
        "realtime",
        "short",
    ),
    Scenario(
        "client-killed",
        "client without a lease killed",
        (SUCCEEDS, HOLDS),
        lambda lab: kill_client(lab, lease=False),
        "realtime",
        "short",
    ),
    Scenario(
        "listeners-stopped",
        "four subscribers to all publications stopped for longer than their session timeout",
        (SUCCEEDS, HOLDS),
        stop_listeners,
        "realtime",
        "short",
    ),
    Scenario(
        "two-clients",
        "goals from three clients, one of which holds a lease",
        (
            none("goals accepted from other clients"),
            none("refusals that do not name the lease holder"),
            none("commands that differ from the plan"),
            exactly("outcome of the holder's goal", "succeeded"),
            exactly("outcome of the holder's second goal, canceled by another client", "canceled"),
            exactly("outcome of another client's goal afterwards", "succeeded"),
        ),
        compete,
    ),
)
