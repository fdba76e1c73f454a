"""A sim that is killed or stopped: controller and planner report it and recover, and the goal is aborted."""

import signal
import time
from contextlib import ExitStack

from protocol import topics
from tools.drill.harness.cell import Cell, answer_or
from tools.drill.harness.lab import Lab
from tools.drill.harness.noise import noisy
from tools.drill.harness.start import CellConfig
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, reported, timed

CONTROLLER_LOGS, PLANNER_LOGS = "the arm fell silent", ("the controller fell silent", "the controller is in fault")
"""Words that the services log when the arm is silent. The planner detects it by the controller's status or silence."""


def silence_sim(lab: Lab, number: signal.Signals, separate_router: bool, noise: bool = False) -> Measured:
    """Kill or stop the sim during a motion, optionally with noise, and restart or continue it after 1.5 s."""
    with lab.cell(CellConfig(clock="realtime", separate_router=separate_router)) as cell, ExitStack() as meanwhile:
        refused = cell.status().cycle.refused
        if noise:
            meanwhile.enter_context(noisy(cell, (topics.STATE, topics.STATUS)))
        reply = cell.begin_motion()
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
        recovery_s = wait_for(lambda: outcome(cell, reply.goal_id) == "aborted", "the goal to be aborted")
        reason = cell.result(reply.goal_id).reason
        cell.recover()
        return {
            "detection time of the controller": 1e3 * (controller - at) if controller else "never",
            "detection time of the planner": planner - at if planner else "never",
            "outcome of the goal": outcome(cell, reply.goal_id),
            "reason of the abort": reason,
            "noise messages counted by the controller": cell.status().cycle.refused - refused,
            "recovery time after the restart": recovery_s,
            "outcome of the next goal": cell.finish(cell.goal(duration=1.5)).outcome,
        }


def outcome(cell: Cell, goal_id: str) -> str:
    """Return the outcome of a goal, or an empty string if the controller does not reply."""
    return answer_or("", lambda: cell.result(goal_id).outcome)


BOUNDS = (
    timed(at_most("detection time of the controller", 20.0, "ms")),
    timed(at_most("detection time of the planner", 1.0, "s")),
    exactly("outcome of the goal", "aborted"),
    reported("reason of the abort"),
    reported("recovery time after the restart", "s"),
    timed(exactly("outcome of the next goal", "succeeded")),
)

SCENARIOS = (
    Scenario(
        "sim-killed",
        "sim and its router killed during a motion, restarted",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGKILL, separate_router=False),
        "realtime",
        "full",
    ),
    Scenario(
        "sim-killed-alone",
        "sim killed during a motion, router in another process; restarted",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGKILL, separate_router=True),
        "realtime",
        "full",
    ),
    Scenario(
        "sim-stopped",
        "sim and its router stopped during a motion, continued",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGSTOP, separate_router=False),
        "realtime",
        "full",
    ),
    Scenario(
        "sim-stopped-alone",
        "sim stopped during a motion, router in another process; continued",
        BOUNDS,
        lambda lab: silence_sim(lab, signal.SIGSTOP, separate_router=True),
        "realtime",
        "full",
    ),
    Scenario(
        "sim-stopped-noise",
        "sim stopped during a motion, router in another process, 1 MB/s of noise as state and status; continued",
        (*BOUNDS, at_least("noise messages counted by the controller", 500)),
        lambda lab: silence_sim(lab, signal.SIGSTOP, separate_router=True, noise=True),
        "realtime",
        "full",
    ),
)
