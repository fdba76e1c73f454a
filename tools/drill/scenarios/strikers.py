"""A striker that is killed during a swing."""

import signal

from protocol import messages as m
from protocol import topics
from tools.drill.harness.cell import Cell
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.waiting import wait_for
from tools.drill.scenario import Measured, Scenario, exactly, none

TARGET = (4.5, 0.0, 0.0)
BALL = m.Throw(position=(5.16, -0.09, 1.34), velocity=(-6.32, -0.49, 0.79))
"""A ball within reach of the shipped arm."""
PACE = 0.5
"""Ratio of robot time to wall time, so that a busy machine plans the swing in time."""


def kill_in_swing(lab: Lab) -> Measured:
    """Kill the striker during a swing, start a new one after the swing, and throw another ball."""
    flags: dict[str, object] = {"learned": lab.folder / "learned.json", "pace": PACE}
    with lab.cell(CellConfig("paced", (*ARM, "striker"), flags=flags)) as cell:
        cell.listen(topics.STATUS)
        throw_ball(cell)
        cell.wait_status(lambda status: status.goal_id, "the swing to begin")
        cell.processes.signal("striker", signal.SIGKILL)
        wait_for(lambda: not cell.bus.is_alive("striker"), "the striker's token to vanish")
        swing = last_goal(cell)
        rest, brakes = cell.status(), cell.state().brake
        cell.processes.start("striker")
        wait_for(lambda: cell.bus.is_alive("striker"), "the new striker")
        throw_ball(cell)
        return {
            "outcome of the swing": cell.result(swing).outcome,
            "faults": int(rest.fault is not None) + int(brakes),
            "reference speed after the swing": max(map(abs, rest.reference.velocities)),
            "phase of the new striker's next strike": "planned",
            "other processes that exited": cell.processes.ended(),
        }


def last_goal(cell: Cell) -> str:
    """Wait until the arm holds, and return the last goal: a correction may have been in flight."""
    moved = [""]

    def rests() -> bool:
        goal_id = cell.status().goal_id
        moved[0] = goal_id or moved[0]
        return goal_id is None

    wait_for(rests, "the swing to end")
    return moved[0]


def throw_ball(cell: Cell) -> None:
    """Request one strike, throw a ball and wait until a swing is planned."""
    strikes = cell.listen(topics.STRIKES)
    while not strikes.empty():
        strikes.get()
    cell.bus.ask(topics.STRIKE, m.StrikeRequest(target=TARGET, count=1))
    cell.bus.ask(topics.SIM_BALL, BALL)
    wait_for(lambda: any(strike.phase == "planned" for strike in cell.drain(topics.STRIKES)), "a swing to be planned")


SCENARIOS = (
    Scenario(
        "striker-killed",
        "striker killed during a swing, a new one started",
        (
            exactly("outcome of the swing", "succeeded"),
            none("faults"),
            exactly("reference speed after the swing", 0.0, "rad/s"),
            none("other processes that exited"),
            exactly("phase of the new striker's next strike", "planned"),
        ),
        kill_in_swing,
        "paced",
        "full",
    ),
)
