"""A sim that is killed or stopped: controller and planner report it and recover by themselves; the goal is aborted."""

import signal
import time
from contextlib import ExitStack

from protocol import topics
from protocol.errors import NoAnswer, Refusal
from tools.drill.harness.cell import Cell
from tools.drill.harness.lab import Lab
from tools.drill.harness.noise import noisy
from tools.drill.harness.start import CellConfig
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, reported, timed

CONTROLLER_LOGS, PLANNER_LOGS = "the arm fell silent", ("the controller fell silent", "the controller is in fault")
"""Words that the two log when the arm is silent; the planner learns it from the controller's status, or gets none."""


def silence_sim(lab: Lab, number: signal.Signals, hosted: bool, noise: bool = False) -> Measured:
    """Kill or stop the sim in a motion, with noise if asked, and restart or continue it after 1.5 s."""
    with lab.cell(CellConfig(clock="realtime", hosted=hosted)) as cell, ExitStack() as meanwhile:
        cell.recover()
        refused = cell.status().cycle.refused
        if noise:
            meanwhile.enter_context(noisy(cell, (topics.STATE, topics.STATUS)))
        reply = cell.under_way()
        at = cell.processes.signal("sim", number)
        time.sleep(1.5)
        controller = cell.processes.logged_at("controller", CONTROLLER_LOGS, at)
        planner = min(
            filter(None, (cell.processes.logged_at("planner", words, at) for words in PLANNER_LOGS)), default=None
        )
        meanwhile.close()
        if number == signal.SIGSTOP:
            cell.processes.signal("sim", signal.SIGCONT)
        else:
            cell.processes.start("sim")
            cell.services.wait_ready(cell.bus)
        back_s = wait_for(lambda: outcome(cell, reply.goal_id) == "aborted", "the goal to be aborted")
        reason = cell.result(reply.goal_id).reason
        cell.recover()
        return {
            "the controller reports it after": 1e3 * (controller - at) if controller else "never",
            "the planner reports it after": planner - at if planner else "never",
            "the goal": outcome(cell, reply.goal_id),
            "its reason": reason,
            "noise that the controller counts": cell.status().cycle.refused - refused,
            "back in service after": back_s,
            "the next goal": cell.finish(cell.goal(duration=1.5)).outcome,
        }


def outcome(cell: Cell, goal_id: str) -> str:
    """Return how a goal went, empty while the controller does not answer."""
    try:
        return cell.result(goal_id).outcome
    except (NoAnswer, Refusal):
        return ""


BOUNDS = (
    timed(at_most("the controller reports it after", 20.0, "ms")),
    timed(at_most("the planner reports it after", 1.0, "s")),
    exactly("the goal", "aborted"),
    reported("its reason"),
    reported("back in service after", "s"),
    timed(exactly("the next goal", "succeeded")),
)

SCENARIOS = (
    Scenario(
        "sim-killed",
        "sim killed in a motion, and the router with it; started again",
        "realtime",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGKILL, hosted=False),
        "full",
    ),
    Scenario(
        "sim-killed-alone",
        "sim killed in a motion, the router elsewhere; started again",
        "realtime",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGKILL, hosted=True),
        "full",
    ),
    Scenario(
        "sim-stopped",
        "sim stopped in a motion, and the router with it; continued",
        "realtime",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGSTOP, hosted=False),
        "full",
    ),
    Scenario(
        "sim-stopped-alone",
        "sim stopped in a motion, the router elsewhere; continued",
        "realtime",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGSTOP, hosted=True),
        "full",
    ),
    Scenario(
        "sim-stopped-noise",
        "sim stopped in a motion, the router elsewhere, 1 MB/s of noise among states and statuses; continued",
        "realtime",
        (*BOUNDS, at_least("noise that the controller counts", 500)),
        lambda lab: silence_sim(lab, signal.SIGSTOP, hosted=True, noise=True),
        "full",
    ),
)
