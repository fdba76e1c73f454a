"""A sim that dies or stops: controller and planner say so, come back by themselves, and the goal is aborted."""

import signal
import time
from contextlib import ExitStack

from protocol import topics
from protocol.errors import NoAnswer, Refusal
from tools.drill.harness.cell import Cell, wait_for
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import Plan
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, timed, told
from tools.drill.scenarios.load import noisy

CONTROLLER_SAYS, PLANNER_SAYS = "the arm fell silent", ("the controller fell silent", "the controller is in fault")
"""Words by which the two log that the arm is gone; the planner hears of it from the controller, or hears nothing."""


def silence_sim(lab: Lab, number: signal.Signals, hosted: bool, noise: bool = False) -> Measured:
    """Kill or stop the sim in mid-motion, if asked amid noise, and bring it back after a second."""
    with lab.cell(Plan(clock="realtime", hosted=hosted)) as cell, ExitStack() as meanwhile:
        cell.recover()
        refused = cell.status().cycle.refused
        if noise:
            meanwhile.enter_context(noisy(cell, (topics.STATE, topics.STATUS)))
        reply = cell.under_way()
        at = cell.signal("sim", number)
        time.sleep(1.5)
        controller = cell.said_at("controller", CONTROLLER_SAYS, at)
        planner = min(filter(None, (cell.said_at("planner", words, at) for words in PLANNER_SAYS)), default=None)
        meanwhile.close()
        if number == signal.SIGSTOP:
            cell.signal("sim", signal.SIGCONT)
        else:
            cell.restart("sim")
            cell.services.wait_ready(cell.bus)
        back_s = wait_for(lambda: outcome(cell, reply.goal_id) == "aborted", "the goal to be aborted")
        reason = cell.result(reply.goal_id).reason
        cell.recover()
        return {
            "controller says so after": 1e3 * (controller - at) if controller else "never",
            "planner says so after": planner - at if planner else "never",
            "the goal": outcome(cell, reply.goal_id),
            "its reason": reason,
            "noise that the controller counts": cell.status().cycle.refused - refused,
            "back in service after": back_s,
            "the next goal": cell.finish(cell.goal(duration=1.5)).outcome,
        }


def outcome(cell: Cell, goal_id: str) -> str:
    """Return how a goal went, empty while nobody answers."""
    try:
        return cell.result(goal_id).outcome
    except (NoAnswer, Refusal):
        return ""


BOUNDS = (
    timed(at_most("controller says so after", 20.0, "ms")),
    timed(at_most("planner says so after", 1.0, "s")),
    exactly("the goal", "aborted"),
    told("its reason"),
    told("back in service after", "s"),
    timed(exactly("the next goal", "succeeded")),
)

SCENARIOS = (
    Scenario(
        "sim-killed",
        "sim killed in a motion, and the bus with it; started again",
        "realtime",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGKILL, hosted=False),
        "full",
    ),
    Scenario(
        "sim-killed-alone",
        "sim killed in a motion, the bus hosted elsewhere; started again",
        "realtime",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGKILL, hosted=True),
        "full",
    ),
    Scenario(
        "sim-stopped",
        "sim stopped in a motion, and the bus with it; continued",
        "realtime",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGSTOP, hosted=False),
        "full",
    ),
    Scenario(
        "sim-stopped-alone",
        "sim stopped in a motion, the bus hosted elsewhere; continued",
        "realtime",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGSTOP, hosted=True),
        "full",
    ),
    Scenario(
        "sim-stopped-noise",
        "the same, with 1 MB/s of noise among states and statuses: noise is no sign of life",
        "realtime",
        (*BOUNDS, at_least("noise that the controller counts", 500)),
        lambda lab: silence_sim(lab, signal.SIGSTOP, hosted=True, noise=True),
        "full",
    ),
)
