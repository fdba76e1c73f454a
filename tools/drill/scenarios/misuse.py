"""Requests in the wrong state, and services that are started twice."""

import signal
import subprocess
import time
from collections import Counter
from queue import SimpleQueue

from protocol import messages as m
from protocol import topics
from protocol.bus.sessions import SERVICE
from services.common.cli import Options
from services.common.single_instance import Outcome
from services.common.supervisor import command_lines
from tools.drill.harness import short_demo
from tools.drill.harness.cell import Cell, refusal_code
from tools.drill.harness.commanded import differing_commands
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_most, exactly, none, timed

AT_ONCE = 5
TAKEN = int(Outcome.TAKEN)


def reset_moving(lab: Lab) -> Measured:
    """Send `reset` at every tenth of a strike."""
    cell = lab.shared_cell()
    reply = cell.strike()
    plan, codes = cell.plan_of(reply), set()
    for tenth in range(10):
        cell.step_to(cell.ticks(reply.start_time) + 100 * tenth + 5)
        codes.add(refusal_code(lambda: cell.bus.ask(topics.RESET, m.Empty())))
    outcome = cell.finish(reply).outcome
    return {
        "refusal codes": ", ".join(sorted(codes)),
        "commands that differ from the plan": differing_commands(cell.commands(), plan, cell.config),
        "outcome of the goal": outcome,
    }


def learn_planning(lab: Lab) -> Measured:
    """Send goals and `learn` requests alternately; count the replies of each kind."""
    cell = lab.shared_cell()
    answers: SimpleQueue[str] = SimpleQueue()
    for k in range(5):
        goal = m.Goal(primitive="forehand", positions=cell.home, plan_only=True, duration=1.0 + 0.1 * k)
        cell.bus.ask_later(topics.GOAL, goal, lambda _: answers.put("planned"))
        learn = short_demo.learn_request(200 if k % 2 else 300, cell.home)
        cell.bus.ask_later(topics.LEARN, learn, lambda _: answers.put("learned"))
    got = Counter(answers.get(timeout=20.0) for _ in range(10))
    entries = [entry.samples for entry in cell.library() if entry.name == short_demo.NAME]
    cell.bus.ask(topics.FORGET, m.Forget(name=short_demo.NAME))
    return {
        "goals not planned": 5 - got["planned"],
        "demonstrations not learned": 5 - got["learned"],
        "samples in the library": ", ".join(map(str, entries)),
    }


def forget_in_use(lab: Lab) -> Measured:
    """Forget the primitive of a running motion, then send a goal that uses it."""
    cell = lab.shared_cell()
    cell.bus.ask(topics.LEARN, short_demo.learn_request(200, cell.home))
    reply = cell.goal(primitive=short_demo.NAME)
    plan = cell.plan_of(reply)
    cell.step_to(cell.ticks(reply.start_time) + 500)
    cell.bus.ask(topics.FORGET, m.Forget(name=short_demo.NAME))
    code = refusal_code(lambda: cell.goal(primitive=short_demo.NAME))
    outcome = cell.finish(reply).outcome
    return {
        "outcome of the goal": outcome,
        "commands that differ from the plan": differing_commands(cell.commands(), plan, cell.config),
        "refusal code of the next goal for it": code,
    }


def start_twice(lab: Lab) -> Measured:
    """Start a second sim, planner and controller for the robot."""
    cell = lab.shared_cell()
    lines = _lines(cell, lab)
    statuses = {name: _status(lines[name]) for name in ARM}
    reply = cell.strike()
    return {
        **{f"exit status of the second {name}": status for name, status in statuses.items()},
        "outcome of the goal": cell.finish(reply).outcome,
    }


def start_at_once(lab: Lab) -> Measured:
    """Start two controllers at the same instant, several times; one must serve, the other must exit."""
    statuses: Counter[str] = Counter()
    with lab.cell(CellConfig(services=("sim",))) as cell:
        line = _lines(cell, lab)["controller"]
        for k in range(AT_ONCE):
            lab.progress(f"attempt {k + 1} of {AT_ONCE}")
            both = [subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for _ in range(2)]
            try:
                wait_for(lambda both=both: any(one.poll() is not None for one in both), "one of two to exit")
                wait_for(cell.mode, "the other to serve")
                statuses.update("serves" if one.poll() is None else str(one.poll()) for one in both)
            finally:
                for one in both:
                    one.terminate()
                    one.wait(30.0)
    return {
        "attempts after which one serves": statuses["serves"],
        f"attempts after which the other exits with {TAKEN}": statuses[str(TAKEN)],
    }


def replace_owner(lab: Lab) -> Measured:
    """Stop a controller until its session expires, start a second, and continue the first during a motion."""
    with lab.cell(CellConfig(clock="realtime")) as cell:
        first = cell.services.running["controller"]
        cell.processes.signal("controller", signal.SIGSTOP)
        try:
            lab.progress("waiting until the session of the stopped controller expires")
            wait_for(lambda: not cell.bus.is_alive("controller"), "the session to expire", 2e-3 * SERVICE.lease_ms)
            cell.processes.start("controller")
            wait_for(lambda: cell.mode() == "fault", "its replacement")
            time.sleep(0.5)  # it answers old states first, and a reset at one of those has no lasting effect
            cell.recover()
            reply = cell.begin_motion()
            first.send_signal(signal.SIGCONT)
            exits_after = wait_for(lambda: first.poll() is not None, "the first to exit")
        finally:
            first.kill()
            status = first.wait()
        outcome = cell.finish(reply).outcome
    return {
        "exit status of the first": status,
        "time until the first exits": exits_after,
        "outcome of the goal": outcome,
    }


def _lines(cell: Cell, lab: Lab) -> dict[str, list[str]]:
    """Return the command lines of a second instance of a cell's services, on a stepped clock."""
    return command_lines(
        Options(robot=cell.bus.robot, robot_config=lab.options.robot_config, listen=(cell.endpoint,)),
        {"clock": "stepped", "library": lab.folder / "second"},
    )


def _status(line: list[str]) -> int:
    return subprocess.run(line, check=False, capture_output=True, timeout=30.0).returncode


AS_PLANNED = none("commands that differ from the plan")
SUCCEEDS = exactly("outcome of the goal", "succeeded")

SCENARIOS = (
    Scenario(
        "reset-moving",
        "`reset` while the arm moves",
        (exactly("refusal codes", "busy"), AS_PLANNED, SUCCEEDS),
        reset_moving,
    ),
    Scenario(
        "learn-planning",
        "`learn` while goals are planned",
        (
            none("goals not planned"),
            none("demonstrations not learned"),
            exactly("samples in the library", "300"),
        ),
        learn_planning,
    ),
    Scenario(
        "forget-in-use",
        "`forget` of the primitive of the running motion",
        (SUCCEEDS, AS_PLANNED, exactly("refusal code of the next goal for it", "unknown_primitive")),
        forget_in_use,
    ),
    Scenario(
        "second-owner",
        "a second sim, planner and controller for one robot",
        (*(exactly(f"exit status of the second {name}", TAKEN) for name in ARM), SUCCEEDS),
        start_twice,
    ),
    Scenario(
        "owners-at-once",
        f"two controllers started at the same instant, {AT_ONCE} times",
        (
            exactly("attempts after which one serves", AT_ONCE),
            exactly(f"attempts after which the other exits with {TAKEN}", AT_ONCE),
        ),
        start_at_once,
    ),
    Scenario(
        "owner-replaced",
        "a controller stopped until its session has expired, replaced by another, then continued",
        (
            exactly("exit status of the first", TAKEN),
            timed(at_most("time until the first exits", 1.0, "s")),
            timed(SUCCEEDS),
        ),
        replace_owner,
        "realtime",
        "full",
    ),
)
