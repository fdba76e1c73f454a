"""A wall clock that jumps, and a machine that stalls."""

import signal
import time
from pathlib import Path

import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.codec import decode
from tools.drill.harness.cell import Cell
from tools.drill.harness.lab import Lab
from tools.drill.harness.shims import counts, shim
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.states import differing_states, missing_ticks
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, reported, timed

STALL_S = 0.5
TOLERANCE_S = 0.05
"""Tolerance for the delay of a request and for other stalls of a shared machine."""

LAG = "robot time lags"
"""Words that the sim logs after a stall."""

WINDOW_NS = 50_000_000
"""Time in which the ticks after a stall are counted."""


class Arrivals:
    """The states published from now on, with the Unix time of each, ns."""

    def __init__(self, cell: Cell) -> None:
        self._collector = cell.bus.collect(topics.STATE, 1 << 14)

    def read(self) -> tuple[np.ndarray, list[m.State]]:
        """Return the times (N,), Unix ns, of the states since the last call, and the states."""
        taken = list(iter(self._collector.take, None))
        return np.array([at for _, at in taken]), [decode(body, m.State) for body, _ in taken]


def ahead_of_robot(cell: Cell) -> float:
    """Return the monotonic time minus robot time, s, to within `TOLERANCE_S`."""
    sent = time.monotonic()
    robot = cell.state().time
    return (sent + time.monotonic()) / 2 - robot


def stall(lab: Lab) -> Measured:
    """Stop all processes for 500 ms during a motion, then continue them."""
    with lab.cell(CellConfig(clock="realtime")) as cell:
        arrivals = Arrivals(cell)
        reply = cell.begin_motion()
        began, ahead = time.time(), ahead_of_robot(cell)
        for name in ARM:
            cell.processes.signal(name, signal.SIGSTOP)
        time.sleep(STALL_S)
        continued = time.time_ns()
        for name in ARM:
            cell.processes.signal(name, signal.SIGCONT)
        time.sleep(1.5)
        result, logged = cell.finish(reply), cell.processes.logged_at("sim", LAG, began)
        lag = ahead_of_robot(cell) - ahead
        at, states = arrivals.read()
    fresh = at[at >= continued] - continued
    busiest = max(int(np.sum((fresh >= start) & (fresh < start + WINDOW_NS))) for start in fresh[:500])
    speeds = np.abs(np.diff([state.positions for state in states], axis=0)) * cell.config.rate_hz
    return {
        "ticks missing or duplicated": missing_ticks(states),
        "lag of robot time": lag,
        "most ticks within 50 ms afterwards": busiest,
        "largest measured speed, fraction of the limit": float((speeds / cell.config.limits.velocities).max()),
        "lag logged by the sim": "no" if logged is None else "yes",
        "outcome of the goal": result.outcome,
    }


def jumping(lab: Lab, clock: m.Clock) -> tuple[CellConfig, Path]:
    """Return a cell in which the wall clock of every process jumps, and the directory of the numbers of jumps."""
    directory = shim("jumping_clock", lab.folder)
    return CellConfig(clock=clock, shims=dict.fromkeys(ARM, directory)), directory


def jump_measurements(jumps: dict[str, int]) -> Measured:
    """Return the measurements of the jumps; the controller reads its wall clock at every tick."""
    return {"processes whose clock jumps": len(jumps), "clock jumps read by the controller": jumps.get("controller", 0)}


def jump(lab: Lab) -> Measured:
    """Play the same strike on the stepped clock with and without a wall clock that jumps."""
    config, directory = jumping(lab, "stepped")
    (plain, _), (jumped, processes) = strike_states(lab, CellConfig()), strike_states(lab, config)
    return {
        **jump_measurements(counts(directory, "jumps", processes)),
        "ticks compared": len(plain),
        "states not bit-identical": differing_states(plain, jumped),
    }


def strike_states(lab: Lab, config: CellConfig) -> tuple[list[bytes], dict[str, int]]:
    """Play a strike; return the bytes of every state, and the ids of the processes."""
    with lab.cell(config) as cell:
        cell.reset(seed=1)
        cell.finish(cell.strike(goal_id="the same"))
        return cell.state_bodies(), cell.processes.pids()


def jump_in_real_time(lab: Lab) -> Measured:
    """Play a motion in real time while the wall clock jumps, and compare robot time with the monotonic clock."""
    config, directory = jumping(lab, "realtime")
    with lab.cell(config) as cell:
        arrivals = Arrivals(cell)
        time.sleep(0.5)
        result = cell.finish(cell.move_aside(2.0))
        at, states = arrivals.read()
        processes = cell.processes.pids()
    passed = (at[-1] - at[0]) * 1e-9
    return {
        **jump_measurements(counts(directory, "jumps", processes)),
        "ticks missing or duplicated": missing_ticks(states),
        "error of robot time against the monotonic clock": float(abs(states[-1].time - states[0].time - passed)),
        "ticks braked": sum(state.brake for state in states),
        "outcome of the goal": result.outcome,
    }


JUMPS = exactly("processes whose clock jumps", len(ARM))

SCENARIOS = (
    Scenario(
        "wall-clock-stepped",
        "the wall clock jumps by two hours and back every 50 ms (as Python reads it), stepped",
        (
            JUMPS,
            at_least("clock jumps read by the controller", 1),
            at_least("ticks compared", 1000),
            none("states not bit-identical"),
        ),
        jump,
    ),
    Scenario(
        "wall-clock",
        "the wall clock jumps by two hours and back every 50 ms, in real time",
        (
            JUMPS,
            at_least("clock jumps read by the controller", 20),
            none("ticks missing or duplicated"),
            timed(at_most("error of robot time against the monotonic clock", TOLERANCE_S, "s")),
            timed(none("ticks braked")),
            timed(exactly("outcome of the goal", "succeeded")),
        ),
        jump_in_real_time,
        "realtime",
        "full",
    ),
    Scenario(
        "stall",
        "all processes stall together for 500 ms during a motion",
        (
            none("ticks missing or duplicated"),
            at_least("lag of robot time", STALL_S - TOLERANCE_S, "s"),
            timed(at_most("lag of robot time", STALL_S + TOLERANCE_S, "s")),
            exactly("lag logged by the sim", "yes"),
            timed(at_most("most ticks within 50 ms afterwards", 52)),
            at_most("largest measured speed, fraction of the limit", 1.0),
            reported("outcome of the goal"),
        ),
        stall,
        "realtime",
        "full",
    ),
)
