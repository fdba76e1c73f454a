"""Requests at the wrong moment, and services that come twice."""

import signal
import subprocess
import time
from collections import Counter
from queue import SimpleQueue

from protocol import messages as m
from protocol import topics
from protocol.bus.sessions import SERVICE
from services.common.cli import Options
from services.common.realtime import EXIT_TAKEN
from services.common.supervisor import command_lines
from tools.drill.harness.cell import Cell, code_of, wait_for
from tools.drill.harness.commanded import unlike_plan
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import ARM, Plan
from tools.drill.scenario import Measured, Scenario, at_most, exactly, none, timed
from tools.drill.scenarios.planners import library, nod

AT_ONCE = 5


def reset_moving(lab: Lab) -> Measured:
    """Send `reset` at every tenth of a strike."""
    cell = lab.shared()
    reply = cell.strike()
    plan, codes = cell.plan_of(reply), set()
    for tenth in range(10):
        cell.step_to(cell.ticks(reply.start_time) + 100 * tenth + 5)
        codes.add(code_of(lambda: cell.bus.ask(topics.RESET, m.Empty())))
    outcome = cell.finish(reply).outcome
    return {
        "refused as": ", ".join(sorted(codes)),
        "commands unlike the plan's samples": unlike_plan(cell.commands(), plan, cell.config),
        "the goal": outcome,
    }


def learn_planning(lab: Lab) -> Measured:
    """Send ten goals to be planned and, between them, requests to learn and to forget; then see what came of each."""
    cell = lab.shared()
    answers: SimpleQueue[str] = SimpleQueue()
    for k in range(5):
        goal = m.Goal(primitive="forehand", positions=cell.home, plan_only=True, duration=1.0 + 0.1 * k)
        cell.bus.ask_later(topics.GOAL, goal, lambda _: answers.put("planned"))
        cell.bus.ask_later(topics.LEARN, nod(200 if k % 2 else 300, cell.home), lambda _: answers.put("learned"))
    got = Counter(answers.get(timeout=20.0) for _ in range(10))
    entries = [entry.samples for entry in library(cell) if entry.name == "nod"]
    cell.bus.ask(topics.FORGET, m.Forget(name="nod"))
    return {
        "goals not planned": 5 - got["planned"],
        "demonstrations not learned": 5 - got["learned"],
        "the library has": ", ".join(map(str, entries)) + " samples",
    }


def forget_in_use(lab: Lab) -> Measured:
    """Forget the primitive of a running motion, then ask for it."""
    cell = lab.shared()
    cell.bus.ask(topics.LEARN, nod(200, cell.home))
    reply = cell.goal(primitive="nod")
    plan = cell.plan_of(reply)
    cell.step_to(cell.ticks(reply.start_time) + 500)
    cell.bus.ask(topics.FORGET, m.Forget(name="nod"))
    code = code_of(lambda: cell.goal(primitive="nod"))
    outcome = cell.finish(reply).outcome
    return {
        "the goal": outcome,
        "commands unlike the plan's samples": unlike_plan(cell.commands(), plan, cell.config),
        "asked for again": code,
    }


def come_twice(lab: Lab) -> Measured:
    """Start a second sim, planner and controller for the robot."""
    cell = lab.shared()
    lines = _lines(cell, lab)
    statuses = {name: _status(lines[name]) for name in ARM}
    reply = cell.strike()
    return {
        **{f"exit status of the second {name}": status for name, status in statuses.items()},
        "the goal": cell.finish(reply).outcome,
    }


def come_at_once(lab: Lab) -> Measured:
    """Start two controllers at the same instant, again and again; one has to serve, the other to leave."""
    statuses: Counter[str] = Counter()
    with lab.cell(Plan(names=("sim",))) as cell:
        line = _lines(cell, lab)["controller"]
        for k in range(AT_ONCE):
            lab.say(f"the {k + 1}. of {AT_ONCE} times")
            both = [subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for _ in range(2)]
            try:
                wait_for(lambda both=both: any(one.poll() is not None for one in both), "one of two to leave")
                wait_for(cell.mode, "the other to serve")
                statuses.update("stays" if one.poll() is None else str(one.poll()) for one in both)
            finally:
                for one in both:
                    one.terminate()
                    one.wait(30.0)
    return {
        "times that one stays": statuses["stays"],
        f"times that the other leaves with {EXIT_TAKEN}": statuses[str(EXIT_TAKEN)],
    }


def come_back(lab: Lab) -> Measured:
    """Stop a controller until its session is lost, let another take its place, and continue the first in a motion."""
    with lab.cell(Plan(clock="realtime")) as cell:
        cell.recover()
        first = cell.services.running["controller"]
        cell.signal("controller", signal.SIGSTOP)
        try:
            lab.say("waits until the stopped controller's session is lost")
            wait_for(lambda: not cell.bus.is_alive("controller"), "the session to be lost", 2e-3 * SERVICE.lease_ms)
            cell.restart("controller")
            wait_for(lambda: cell.mode() == "fault", "another to take its place")
            time.sleep(0.5)  # it answers old states first, and a reset at one of those does not last
            cell.recover()
            reply = cell.under_way()
            first.send_signal(signal.SIGCONT)
            gone_after = wait_for(lambda: first.poll() is not None, "the first to leave")
        finally:
            first.kill()
            status = first.wait()
        outcome = cell.finish(reply).outcome
    return {"exit status of the first": status, "it leaves after": gone_after, "the goal": outcome}


def _lines(cell: Cell, lab: Lab) -> dict[str, list[str]]:
    """The command lines of further services for the robot of a cell, on a stepped clock."""
    return command_lines(
        Options(robot=cell.bus.robot, robot_config=lab.options.robot_config, listen=(cell.endpoint,)),
        {"clock": "stepped", "library": lab.folder / "second"},
    )


def _status(line: list[str]) -> int:
    return subprocess.run(line, check=False, capture_output=True, timeout=30.0).returncode


UNLIKE = none("commands unlike the plan's samples")
PLAYS = exactly("the goal", "succeeded")

SCENARIOS = (
    Scenario(
        "reset-moving",
        "`reset` while the arm moves",
        "stepped",
        (exactly("refused as", "busy"), UNLIKE, PLAYS),
        reset_moving,
    ),
    Scenario(
        "learn-planning",
        "`learn` while goals are planned",
        "stepped",
        (
            none("goals not planned"),
            none("demonstrations not learned"),
            exactly("the library has", "300 samples"),
        ),
        learn_planning,
    ),
    Scenario(
        "forget-in-use",
        "`forget` of the primitive that is played",
        "stepped",
        (PLAYS, UNLIKE, exactly("asked for again", "unknown_primitive")),
        forget_in_use,
    ),
    Scenario(
        "second-owner",
        "a second sim, planner and controller for one robot",
        "stepped",
        (*(exactly(f"exit status of the second {name}", EXIT_TAKEN) for name in ARM), PLAYS),
        come_twice,
    ),
    Scenario(
        "owners-at-once",
        f"two controllers started at the same instant, {AT_ONCE} times",
        "stepped",
        (
            exactly("times that one stays", AT_ONCE),
            exactly(f"times that the other leaves with {EXIT_TAKEN}", AT_ONCE),
        ),
        come_at_once,
    ),
    Scenario(
        "owner-replaced",
        "a controller stopped until its session is lost and replaced, then continued",
        "realtime",
        (
            exactly("exit status of the first", EXIT_TAKEN),
            timed(at_most("it leaves after", 1.0, "s")),
            timed(PLAYS),
        ),
        come_back,
        "full",
    ),
)
