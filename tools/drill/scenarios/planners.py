"""A planner that is killed during a motion, and while it learns."""

import random
import signal
import statistics
import time

from protocol import messages as m
from protocol import topics
from tools.drill.harness.cell import Cell
from tools.drill.harness.commanded import differing_commands
from tools.drill.harness.lab import Lab
from tools.drill.harness.short_demo import NAME, SECONDS, learn_request
from tools.drill.harness.start import CellConfig
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, reported, timed

ATTEMPTS = 100


def kill_in_motion(lab: Lab) -> Measured:
    """Kill the planner during a strike, start a new planner after the strike, and count its primitives."""
    with lab.cell(CellConfig()) as cell:
        cell.reset()
        cell.bus.ask(topics.LEARN, learn_request(200, cell.home))
        before = cell.bus.ask(topics.PRIMITIVES, m.Empty()).primitives
        reply = cell.strike()
        plan = cell.plan_of(reply)
        cell.step_to(cell.ticks(reply.start_time) + 300)
        cell.processes.signal("planner", signal.SIGKILL)
        result = cell.finish(reply)
        began = time.monotonic()
        cell.processes.start("planner")
        wait_for(lambda: cell.library(), "the new planner")
        restart_s = time.monotonic() - began
        after = cell.library()
        return {
            "outcome of the goal": result.outcome,
            "reference speed after the stop": max(map(abs, cell.commands()[-1].velocities)),
            "commands that differ from the plan": differing_commands(cell.commands(), plan, cell.config),
            "time until the new planner replies": restart_s,
            "primitives lost": sum(entry not in after for entry in before),
            "outcome of the next goal": cell.finish(cell.goal(primitive=NAME, duration=1.0)).outcome,
        }


def kill_learning(lab: Lab) -> Measured:
    """Kill the planner at random instants during and after `learn`; count the versions in its successor's library."""
    instants = random.Random(5)
    broken = old = new = unfinished = 0
    takes_s: list[float] = []
    with lab.cell(CellConfig(services=("planner",), separate_router=True)) as cell:
        known = 200
        for attempt in range(ATTEMPTS):
            lab.progress(f"attempt {attempt + 1} of {ATTEMPTS}")
            other = 500 - known
            # A planner's first request starts its worker and is slow, as are the first one of each length and one whose
            # length differs from the last. This last kind is timed, because the interrupted request is one.
            for count in (other, known):
                cell.bus.ask(topics.LEARN, learn_request(count, cell.home))
            began = time.monotonic()
            cell.bus.ask(topics.LEARN, learn_request(other, cell.home))
            takes_s.append(time.monotonic() - began)
            cell.bus.ask(topics.LEARN, learn_request(known, cell.home))
            cell.bus.ask_later(topics.LEARN, learn_request(other, cell.home), lambda _: None)
            time.sleep(instants.uniform(0.0, 1.5 * takes_s[-1]))
            cell.processes.signal("planner", signal.SIGKILL)
            unfinished += any((cell.folder / "library").glob(".*.tmp"))
            wait_for(lambda: not cell.bus.is_alive("planner"), "the planner's token to vanish")
            cell.processes.start("planner")
            wait_for(lambda: cell.library(), "the new planner")
            found = next((entry.samples for entry in cell.library() if entry.name == NAME), 0)
            whole = found in SECONDS and plays(cell, SECONDS[found])
            broken += not whole
            old += whole and found == known
            new += whole and found == other
            known = found if whole else known
    return {
        "attempts": ATTEMPTS,
        "libraries with neither version": broken,
        "libraries with the old version": old,
        "libraries with the new version": new,
        "kills during a write": unfinished,
        "learning time": 1e3 * statistics.median(takes_s),
    }


def plays(cell: Cell, duration: float) -> bool:
    """Return whether a goal of the primitive can be planned and has the demonstrated duration."""
    reply = cell.goal(primitive=NAME, plan_only=True)
    return abs(reply.duration - duration) < 2 * cell.config.tick


SCENARIOS = (
    Scenario(
        "planner-killed",
        "planner killed during a strike, a new one started",
        (
            exactly("outcome of the goal", "succeeded"),
            none("commands that differ from the plan"),
            exactly("reference speed after the stop", 0.0, "rad/s"),
            none("primitives lost"),
            exactly("outcome of the next goal", "succeeded"),
        ),
        kill_in_motion,
    ),
    Scenario(
        "planner-restarted",
        "planner killed during a strike: time until a new one replies",
        (timed(at_most("time until the new planner replies", 3.0, "s")), none("primitives lost")),
        kill_in_motion,
        "realtime",
        "short",
    ),
    Scenario(
        "planner-killed-learning",
        "planner killed at a random instant of `learn`",
        (
            exactly("attempts", ATTEMPTS),
            none("libraries with neither version"),
            at_least("libraries with the old version", 5),
            at_least("libraries with the new version", 5),
            reported("kills during a write"),
            reported("learning time", "ms"),
        ),
        kill_learning,
        "realtime",
        "full",
    ),
)
