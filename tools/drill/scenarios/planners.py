"""A planner that is killed, in a motion and while it learns."""

import random
import signal
import statistics
import time

from protocol import messages as m
from protocol import topics
from tools.drill.harness.cell import Cell
from tools.drill.harness.commanded import unlike_plan
from tools.drill.harness.lab import Lab
from tools.drill.harness.short_demo import NAME, SECONDS, learn_request
from tools.drill.harness.start import CellConfig
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, reported, timed

TRIES = 100


def kill_in_motion(lab: Lab) -> Measured:
    """Kill the planner in a strike, let the strike end, start a new planner and count its primitives."""
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
        answers_s = time.monotonic() - began
        after = cell.library()
        return {
            "the goal": result.outcome,
            "speed of the reference at the end of the stop": max(map(abs, cell.commands()[-1].velocities)),
            "commands unlike the plan's samples": unlike_plan(cell.commands(), plan, cell.config),
            "a new planner answers after": answers_s,
            "primitives lost": sum(entry not in after for entry in before),
            "the next goal": cell.finish(cell.goal(primitive=NAME, duration=1.0)).outcome,
        }


def kill_learning(lab: Lab) -> Measured:
    """Kill the planner at random instants during and after a `learn`; look up what its successor has."""
    instants = random.Random(5)
    broken = old = new = unfinished = 0
    takes_s: list[float] = []
    with lab.cell(CellConfig(names=("planner",), hosted=True)) as cell:
        known = 200
        for attempt in range(TRIES):
            lab.progress(f"try {attempt + 1} of {TRIES}")
            other = 500 - known
            # The first request of a planner starts its worker, and the first of each length takes longer than others.
            # So does one of another length than the last; it is timed, because the interrupted request is like it.
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
        "tries": TRIES,
        "libraries with neither version": broken,
        "libraries with the old version": old,
        "libraries with the new version": new,
        "kills in the middle of a write": unfinished,
        "learning takes": 1e3 * statistics.median(takes_s),
    }


def plays(cell: Cell, duration: float) -> bool:
    """Whether the primitive can be planned with, and lasts as demonstrated."""
    reply = cell.goal(primitive=NAME, plan_only=True)
    return abs(reply.duration - duration) < 2 * cell.config.tick


SCENARIOS = (
    Scenario(
        "planner-killed",
        "planner killed in a strike, a new one started",
        "stepped",
        (
            exactly("the goal", "succeeded"),
            none("commands unlike the plan's samples"),
            exactly("speed of the reference at the end of the stop", 0.0, "rad/s"),
            none("primitives lost"),
            exactly("the next goal", "succeeded"),
        ),
        kill_in_motion,
    ),
    Scenario(
        "planner-restarted",
        "planner killed in a strike: how long until a new one answers",
        "realtime",
        (timed(at_most("a new planner answers after", 3.0, "s")), none("primitives lost")),
        kill_in_motion,
        "short",
    ),
    Scenario(
        "planner-killed-learning",
        "planner killed at any instant of `learn`",
        "realtime",
        (
            exactly("tries", TRIES),
            none("libraries with neither version"),
            at_least("libraries with the old version", 5),
            at_least("libraries with the new version", 5),
            reported("kills in the middle of a write"),
            reported("learning takes", "ms"),
        ),
        kill_learning,
        "full",
    ),
)
