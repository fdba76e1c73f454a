"""Lost messages, and a controller that is killed or hangs: after 20 ticks without a command the arm brakes."""

import signal

import numpy as np

from protocol import messages as m
from protocol import topics
from tools.drill.harness.cell import refusal_code
from tools.drill.harness.commanded import differing_commands
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import CellConfig
from tools.drill.harness.states import ticks_without_command
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, at_most, exactly, none, timed

LOST_TICKS = (1, 2, 7, 13, 19)


def lose_few(lab: Lab, stream: str) -> Measured:
    """Drop a few messages during a strike, and compare every command with the plan."""
    cell = lab.shared_cell()
    differing = braked = uncounted = 0
    for ticks in LOST_TICKS:
        cell.reset()
        reply = cell.strike()
        cell.step_to(cell.ticks(reply.start_time) + 300)
        missed = cell.status().cycle.missed
        cell.drop_messages(stream, ticks)
        cell.finish(reply)
        differing += differing_commands(
            cell.commands(), cell.plan_of(reply), cell.config, ticks if stream == "state" else 0
        )
        braked += sum(state.brake for state in cell.states())
        uncounted += abs(ticks - (cell.status().cycle.missed - missed))
    return {
        "commands that differ from the plan": differing,
        "ticks braked": braked,
        "error in the count of missed ticks": uncounted,
    }


def lose_many(lab: Lab, stream: str) -> Measured:
    """Drop 20 messages during a strike, send a goal during the fault, reset, and send another goal."""
    cell = lab.shared_cell()
    reply = cell.strike()
    cell.step_to(cell.ticks(reply.start_time) + 300)
    cell.drop_messages(stream, cell.config.silence_ticks)
    cell.step(200)
    braking = next((state for state in cell.states() if state.brake), None)
    aborted = cell.result(reply.goal_id).outcome
    not_refused = int(refusal_code(cell.goal) != "fault")
    cell.step(400)
    rest = cell.state().positions
    cell.bus.ask(topics.RESET, m.Empty())
    cell.step(100)
    held = np.array([state.positions for state in cell.states()[-100:]])
    return {
        "ticks without a command until the arm brakes": braking.tick - braking.applied_tick - 1 if braking else np.nan,
        "outcome of the goal": aborted,
        "goals not refused as `fault`": not_refused,
        "position change at the reset": float(np.abs(held - rest).max()),
        "outcome of the next goal": cell.finish(cell.goal()).outcome,
    }


def distance(one: list[float], other: list[float]) -> float:
    """Return the largest difference over the joints, rad."""
    return float(np.abs(np.subtract(one, other)).max())


def silence_controller(lab: Lab, number: signal.Signals) -> Measured:
    """Kill or stop the controller during a motion; start a new one or continue it; reset."""
    with lab.cell(CellConfig(clock="realtime")) as cell:
        cell.listen(topics.STATE)
        cell.begin_motion()
        cell.processes.signal("controller", number)
        wait_for(lambda: cell.state().brake, "the arm to brake")
        cell.pass_time(0.6)
        rest = cell.state()
        if number == signal.SIGSTOP:
            cell.processes.signal("controller", signal.SIGCONT)
        else:
            cell.processes.start("controller")
        wait_for(lambda: cell.mode() == "fault", "the controller to be in fault")
        not_refused = int(refusal_code(cell.goal) != "fault")
        drift = distance(cell.state().positions, rest.positions)
        cell.recover()
        cell.pass_time(0.3)
        moved = distance(cell.state().positions, rest.positions)
        outcome = cell.finish(cell.goal(duration=1.5)).outcome
        seen = cell.drain(topics.STATE)
    return {
        "ticks without a command until the arm brakes": ticks_without_command(seen),
        "largest joint speed after braking": float(np.abs(rest.velocities).max()),
        "position change before the reset": drift,
        "goals not refused as `fault`": not_refused,
        "position change at the reset": moved,
        "outcome of the next goal": outcome,
    }


SHORT_LOSS = (
    none("commands that differ from the plan"),
    none("ticks braked"),
    none("error in the count of missed ticks"),
)
BRAKES = exactly("ticks without a command until the arm brakes", 20)
REFUSES = none("goals not refused as `fault`")
RESTS = at_most("position change at the reset", 1e-3, "rad")
NEXT_SUCCEEDS = exactly("outcome of the next goal", "succeeded")
LONG_LOSS = (BRAKES, exactly("outcome of the goal", "aborted"), REFUSES, RESTS, NEXT_SUCCEEDS)
NO_CONTROLLER = (
    BRAKES,
    at_most("largest joint speed after braking", 1e-3, "rad/s"),
    REFUSES,
    at_most("position change before the reset", 1e-3, "rad"),
    RESTS,
    timed(NEXT_SUCCEEDS),
)
LOST = ", ".join(map(str, LOST_TICKS))

SCENARIOS = (
    Scenario("loss-states", f"{LOST} states lost during a strike", SHORT_LOSS, lambda lab: lose_few(lab, "state")),
    Scenario(
        "loss-commands", f"{LOST} commands lost during a strike", SHORT_LOSS, lambda lab: lose_few(lab, "command")
    ),
    Scenario("silence-states", "20 states lost during a strike", LONG_LOSS, lambda lab: lose_many(lab, "state")),
    Scenario("silence-commands", "20 commands lost during a strike", LONG_LOSS, lambda lab: lose_many(lab, "command")),
    Scenario(
        "controller-killed",
        "controller killed during a motion, a new one started",
        NO_CONTROLLER,
        lambda lab: silence_controller(lab, signal.SIGKILL),
        "realtime",
        "short",
    ),
    Scenario(
        "controller-stopped",
        "controller stopped during a motion for a second, then continued",
        NO_CONTROLLER,
        lambda lab: silence_controller(lab, signal.SIGSTOP),
        "realtime",
        "full",
    ),
)
