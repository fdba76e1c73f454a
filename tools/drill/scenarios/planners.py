"""A planner that dies, in a motion and while it learns."""

import math
import random
import signal
import statistics
import time

from protocol import messages as m
from protocol import topics
from protocol.errors import NoAnswer, Refusal
from tools.drill.harness.cell import Cell, wait_for
from tools.drill.harness.commanded import unlike_plan
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import Plan
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, timed, told

TRIES = 100
SECONDS = {200: 2.0, 300: 3.0}
"""Two demonstrations that are told apart: samples, and the duration learned from them, s."""


def nod(samples: int, home: list[float], replace: bool = True) -> m.Learn:
    """Return the request to learn a small move of joint_1 that lasts as `SECONDS` says."""
    positions = [[home[0] + 0.2 * math.sin(3.0 * k / samples), *home[1:]] for k in range(samples)]
    return m.Learn(name="nod", positions=positions, rate=(samples - 1) / SECONDS[samples], replace=replace)


def kill_in_motion(lab: Lab) -> Measured:
    """Kill the planner in mid-strike, let the strike end, start a new planner and count what it knows."""
    with lab.cell(Plan()) as cell:
        cell.reset()
        cell.bus.ask(topics.LEARN, nod(200, cell.home))
        before = cell.bus.ask(topics.PRIMITIVES, m.Empty()).primitives
        reply = cell.strike()
        plan = cell.plan_of(reply)
        cell.step_to(cell.ticks(reply.start_time) + 300)
        cell.signal("planner", signal.SIGKILL)
        result = cell.finish(reply)
        began = time.monotonic()
        cell.restart("planner")
        wait_for(lambda: library(cell), "the new planner")
        served_s = time.monotonic() - began
        after = library(cell)
        return {
            "the goal": result.outcome,
            "speed of the reference at the tail's end": max(map(abs, cell.commands()[-1].velocities)),
            "commands unlike the plan's samples": unlike_plan(cell.commands(), plan, cell.config),
            "a new planner serves after": served_s,
            "primitives lost": sum(entry not in after for entry in before),
            "the next goal": cell.finish(cell.goal(primitive="nod", duration=1.0)).outcome,
        }


def library(cell: Cell) -> list[m.PrimitiveEntry]:
    """Return the library's entries, none while no planner answers."""
    try:
        return cell.bus.ask(topics.PRIMITIVES, m.Empty(), timeout=1.0).primitives
    except (NoAnswer, Refusal):
        return []


def kill_learning(lab: Lab) -> Measured:
    """Kill the planner at random instants from the request to learn to after its answer; see what its successor has."""
    instants = random.Random(5)
    broken = old = new = unfinished = 0
    takes_s: list[float] = []
    with lab.cell(Plan(names=("planner",), hosted=True)) as cell:
        known = 200
        for attempt in range(TRIES):
            lab.say(f"try {attempt + 1} of {TRIES}")
            other = 500 - known
            # A new planner first loads what learning needs, which takes far longer than to learn.
            cell.bus.ask(topics.LEARN, nod(known, cell.home))
            began = time.monotonic()
            cell.bus.ask(topics.LEARN, nod(known, cell.home))
            takes_s.append(time.monotonic() - began)
            cell.bus.ask_later(topics.LEARN, nod(other, cell.home), lambda _: None)
            time.sleep(instants.uniform(0.0, 1.5 * takes_s[-1]))
            cell.signal("planner", signal.SIGKILL)
            unfinished += any((cell.folder / "library").glob(".*.tmp"))
            wait_for(lambda: not cell.bus.is_alive("planner"), "the planner's token to go")
            cell.restart("planner")
            wait_for(lambda: library(cell), "the new planner")
            found = next((entry.samples for entry in library(cell) if entry.name == "nod"), 0)
            whole = found in SECONDS and plays(cell, SECONDS[found])
            broken += not whole
            old += whole and found == known
            new += whole and found == other
            known = found if whole else known
    return {
        "tries": TRIES,
        "libraries with neither the old nor the new": broken,
        "with the old": old,
        "with the new": new,
        "killed in the middle of the file": unfinished,
        "learning takes": 1e3 * statistics.median(takes_s),
    }


def plays(cell: Cell, duration: float) -> bool:
    """Whether the primitive can be planned with, and lasts as it was taught."""
    reply = cell.goal(primitive="nod", plan_only=True)
    return abs(reply.duration - duration) < 2 * cell.config.tick


SCENARIOS = (
    Scenario(
        "planner-killed",
        "planner killed in a strike, a new one started",
        "stepped",
        (
            exactly("the goal", "succeeded"),
            none("commands unlike the plan's samples"),
            exactly("speed of the reference at the tail's end", 0.0, "rad/s"),
            none("primitives lost"),
            exactly("the next goal", "succeeded"),
        ),
        kill_in_motion,
    ),
    Scenario(
        "planner-restarted",
        "the same, timed: how long a planner takes from its start",
        "realtime",
        (timed(at_most("a new planner serves after", 3.0, "s")), none("primitives lost")),
        kill_in_motion,
        "short",
    ),
    Scenario(
        "planner-killed-learning",
        "planner killed at any instant of `learn`",
        "realtime",
        (
            exactly("tries", TRIES),
            none("libraries with neither the old nor the new"),
            at_least("with the old", 5),
            at_least("with the new", 5),
            told("killed in the middle of the file"),
            told("learning takes", "ms"),
        ),
        kill_learning,
        "full",
    ),
)
