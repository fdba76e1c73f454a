"""Lost messages, and a controller that is killed or hangs: the arm goes on for 19 ticks and then brakes by itself."""

import signal

import numpy as np

from protocol import messages as m
from protocol import topics
from tools.drill.harness.cell import code_of
from tools.drill.harness.commanded import unlike_plan
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import CellConfig
from tools.drill.harness.states import silent_ticks
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_most, exactly, none, timed

LOST_TICKS = (1, 2, 7, 13, 19)


def lose_few(lab: Lab, stream: str) -> Measured:
    """Lose a few messages in a strike and compare every command with the plan."""
    cell = lab.shared()
    unlike = braked = uncounted = 0
    for ticks in LOST_TICKS:
        cell.reset()
        reply = cell.strike()
        cell.step_to(cell.ticks(reply.start_time) + 300)
        missed = cell.status().cycle.missed
        cell.lose(stream, ticks)
        cell.finish(reply)
        unlike += unlike_plan(cell.commands(), cell.plan_of(reply), cell.config, ticks if stream == "state" else 0)
        braked += sum(state.brake for state in cell.states())
        uncounted += abs(ticks - (cell.status().cycle.missed - missed))
    return {
        "commands unlike the plan's samples": unlike,
        "ticks braked": braked,
        "lost ticks not counted": uncounted,
    }


def lose_many(lab: Lab, stream: str) -> Measured:
    """Lose 20 messages in a strike, ask for a goal in the fault, reset, and go on."""
    cell = lab.shared()
    reply = cell.strike()
    cell.step_to(cell.ticks(reply.start_time) + 300)
    cell.lose(stream, cell.config.silence_ticks)
    cell.step(200)
    braking = next((state for state in cell.states() if state.brake), None)
    aborted = cell.result(reply.goal_id).outcome
    not_refused = int(code_of(cell.goal) != "fault")
    cell.step(400)
    rest = cell.state().positions
    cell.bus.ask(topics.RESET, m.Empty())
    cell.step(100)
    held = np.array([state.positions for state in cell.states()[-100:]])
    return {
        "silent ticks until the arm brakes": braking.tick - braking.applied_tick - 1 if braking else np.nan,
        "the goal": aborted,
        "goals not refused as `fault`": not_refused,
        "jump at the reset": float(np.abs(held - rest).max()),
        "the next goal": cell.finish(cell.goal()).outcome,
    }


def distance(one: list[float], other: list[float]) -> float:
    """Return the largest difference of any joint."""
    return float(np.abs(np.subtract(one, other)).max())


def silence_controller(lab: Lab, number: signal.Signals) -> Measured:
    """Kill or stop the controller in a motion; start a new one, or continue it; reset."""
    with lab.cell(CellConfig(clock="realtime")) as cell:
        cell.recover()
        cell.listen(topics.STATE)
        cell.under_way()
        cell.processes.signal("controller", number)
        wait_for(lambda: cell.state().brake, "the arm to brake")
        cell.pass_time(0.6)
        rest = cell.state()
        if number == signal.SIGSTOP:
            cell.processes.signal("controller", signal.SIGCONT)
        else:
            cell.processes.start("controller")
        wait_for(lambda: cell.mode() == "fault", "the controller to be in fault")
        not_refused = int(code_of(cell.goal) != "fault")
        drift = distance(cell.state().positions, rest.positions)
        cell.recover()
        cell.pass_time(0.3)
        moved = distance(cell.state().positions, rest.positions)
        outcome = cell.finish(cell.goal(duration=1.5)).outcome
        seen = cell.drain(topics.STATE)
    return {
        "silent ticks until the arm brakes": silent_ticks(seen),
        "speed of the braked arm at rest": float(np.abs(rest.velocities).max()),
        "moved before the reset": drift,
        "goals not refused as `fault`": not_refused,
        "jump at the reset": moved,
        "the next goal": outcome,
    }


FEW = (none("commands unlike the plan's samples"), none("ticks braked"), none("lost ticks not counted"))
BRAKES = exactly("silent ticks until the arm brakes", 20)
REFUSES = none("goals not refused as `fault`")
STAYS = at_most("jump at the reset", 1e-3, "rad")
GOES_ON = exactly("the next goal", "succeeded")
MANY = (BRAKES, exactly("the goal", "aborted"), REFUSES, STAYS, GOES_ON)
ALONE = (
    BRAKES,
    at_most("speed of the braked arm at rest", 1e-3, "rad/s"),
    REFUSES,
    at_most("moved before the reset", 1e-3, "rad"),
    STAYS,
    timed(GOES_ON),
)
LOST = ", ".join(map(str, LOST_TICKS))

SCENARIOS = (
    Scenario("loss-states", f"{LOST} states lost in a strike", "stepped", FEW, lambda lab: lose_few(lab, "state")),
    Scenario(
        "loss-commands", f"{LOST} commands lost in a strike", "stepped", FEW, lambda lab: lose_few(lab, "command")
    ),
    Scenario("silence-states", "20 states lost in a strike", "stepped", MANY, lambda lab: lose_many(lab, "state")),
    Scenario(
        "silence-commands", "20 commands lost in a strike", "stepped", MANY, lambda lab: lose_many(lab, "command")
    ),
    Scenario(
        "controller-killed",
        "controller killed in a motion, a new one started",
        "realtime",
        ALONE,
        lambda lab: silence_controller(lab, signal.SIGKILL),
        "short",
    ),
    Scenario(
        "controller-stopped",
        "controller stopped in a motion for a second, then continued",
        "realtime",
        ALONE,
        lambda lab: silence_controller(lab, signal.SIGSTOP),
        "full",
    ),
)
