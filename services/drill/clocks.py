"""A wall clock that jumps, and a machine that stalls."""

import signal
import time

import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.codec import decode
from services.drill.cell import ARM, Cell, Plan, wait_for
from services.drill.lab import Lab
from services.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, told
from services.drill.shims import shim

STALL_S = 0.5
LAG = "robot time lags"
"""What the sim logs after a stall."""

WINDOW_NS = 50_000_000


class Arrivals:
    """Every state from now on, with when the sim sent it, Unix ns."""

    def __init__(self, cell: Cell) -> None:
        self._collector = cell.bus.collect(topics.STATE, 1 << 14)

    def read(self) -> tuple[np.ndarray, list[m.State]]:
        """Return when the states since the last call were sent (N,), ns, and the states."""
        heard = list(iter(self._collector.take, None))
        return np.array([at for _, at in heard]), [decode(body, m.State) for body, _ in heard]


def gaps(states: list[m.State]) -> int:
    """Return how many ticks are missing or doubled among the states."""
    return int(np.sum(np.diff([state.tick for state in states]) != 1))


def stall(lab: Lab) -> Measured:
    """Stop every process for 500 ms in mid-motion and continue all."""
    with lab.cell(Plan(clock="realtime")) as cell:
        cell.recover()
        arrivals = Arrivals(cell)
        reply = cell.goal(positions=[0.5, *cell.home[1:]], duration=2.0)
        wait_for(lambda: cell.state().time > reply.start_time + 0.7, "the motion to be under way")
        for name in ARM:
            cell.signal(name, signal.SIGSTOP)
        time.sleep(STALL_S)
        continued = time.time_ns()
        for name in ARM:
            cell.signal(name, signal.SIGCONT)
        time.sleep(1.5)
        wait_for(lambda: cell.result(reply.goal_id).outcome != "running", "the motion to end")
        result, said = cell.result(reply.goal_id), LAG in cell.log("sim")
        at, states = arrivals.read()
    before, after = at < continued, at >= continued
    lag = np.diff(at[[np.flatnonzero(before)[-1], np.flatnonzero(after)[0]]])[0] * 1e-9
    fresh = at[after] - continued
    busiest = max(int(np.sum((fresh >= start) & (fresh < start + WINDOW_NS))) for start in fresh[:500])
    speeds = np.abs(np.diff([state.positions for state in states], axis=0)) * cell.config.rate_hz
    return {
        "ticks missing or doubled": gaps(states),
        "robot time lags by": float(lag),
        "most ticks in any 50 ms afterwards": busiest,
        "fastest measured step beside the velocity limit": float((speeds / cell.config.limits.velocities).max()),
        "the sim counts the lag": "yes" if said else "no",
        "the goal": result.outcome,
    }


def jump(lab: Lab) -> Measured:
    """Play the same strike on the stepped clock with and without a wall clock that jumps."""
    runs = [strike_states(lab, shims) for shims in ({}, {name: shim("jumping_clock", lab.folder) for name in ARM})]
    return {"ticks compared": len(runs[0]), "states that differ in a bit": differing(*runs)}


def strike_states(lab: Lab, shims: dict) -> list[bytes]:
    """Return the bytes of every state of a strike."""
    with lab.cell(Plan(shims=shims)) as cell:
        cell.reset(seed=1)
        cell.finish(cell.strike(goal_id="the same"))
        return cell.state_bodies()


def differing(one: list[bytes], other: list[bytes]) -> int:
    """Return how many states differ in a bit; those that only one run has differ."""
    return sum(a != b for a, b in zip(one, other, strict=False)) + abs(len(one) - len(other))


def jump_in_real_time(lab: Lab) -> Measured:
    """Play a motion in real time while the wall clock jumps, and hold robot time against the monotonic clock."""
    with lab.cell(Plan(clock="realtime", shims={name: shim("jumping_clock", lab.folder) for name in ARM})) as cell:
        cell.recover()
        arrivals = Arrivals(cell)
        time.sleep(0.5)
        result = cell.finish(cell.goal(positions=[0.5, *cell.home[1:]], duration=2.0))
        at, states = arrivals.read()
    passed = (at[-1] - at[0]) * 1e-9
    return {
        "jumps of the wall clock meanwhile": int(passed / 0.05),
        "ticks missing or doubled": gaps(states),
        "robot time off the monotonic clock": abs((states[-1].time - states[0].time) / passed - 1.0) * 100,
        "ticks braked": sum(state.brake for state in states),
        "the goal": result.outcome,
    }


SCENARIOS = (
    Scenario(
        "wall-clock-stepped",
        "the wall clock jumps by two hours and back every 50 ms (as Python reads it), stepped",
        "stepped",
        (at_least("ticks compared", 1000), none("states that differ in a bit")),
        jump,
    ),
    Scenario(
        "wall-clock",
        "the same in real time",
        "realtime",
        (
            at_least("jumps of the wall clock meanwhile", 20),
            none("ticks missing or doubled"),
            at_most("robot time off the monotonic clock", 1.0, "%"),
            none("ticks braked"),
            exactly("the goal", "succeeded"),
        ),
        jump_in_real_time,
        "full",
    ),
    Scenario(
        "stall",
        "all processes stall together for 500 ms in a motion",
        "realtime",
        (
            none("ticks missing or doubled"),
            at_least("robot time lags by", STALL_S, "s"),
            exactly("the sim counts the lag", "yes"),
            at_most("most ticks in any 50 ms afterwards", 52),
            at_most("fastest measured step beside the velocity limit", 1.0),
            told("the goal"),
        ),
        stall,
        "full",
    ),
)
