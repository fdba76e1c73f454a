"""Goals that must be refused, during a motion whose states must remain bit-identical."""

from collections.abc import Callable

import msgspec

from protocol import messages as m
from protocol import topics
from tools.drill.harness.cell import Cell, refusal_code
from tools.drill.harness.lab import Lab
from tools.drill.harness.shims import shim
from tools.drill.harness.start import CellConfig
from tools.drill.harness.states import differing_states
from tools.drill.scenario import Measured, Scenario, exactly, none, reported

Send = Callable[[Cell, m.Trajectory], str]
"""Sends a request that must be refused, and returns the code of the refusal."""

JERK = 2000.0
"""Jerk limit, rad/s³, active and feasible at every tenth; an infeasible goal may be refused without a program."""


def refuse_at_every_tenth(cell: Cell, send: Send) -> Measured:
    """Play a trajectory twice, the second time with a request at every tenth; compare the bytes of the states."""
    trajectory = cell.strike(plan_only=True, include_trajectory=True).trajectory
    assert trajectory is not None
    seed, runs, codes = cell.run + 1, [], set()
    for sending in (False, True):
        cell.reset(seed=seed)
        epoch = cell.bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=0.0)).epoch
        played = msgspec.structs.replace(trajectory, epoch=epoch, goal_id=f"{send.__name__} {sending} {seed}")
        cell.bus.ask(topics.EXECUTE, played)
        for tenth in range(1, 11):
            cell.step_to(20 + 100 * tenth)
            if sending:
                codes.add(send(cell, trajectory))
        cell.step_to(1500)
        runs.append(cell.state_bodies())
    return {
        "refusal codes": ", ".join(sorted(codes)),
        "states compared": len(runs[0]),
        "states not bit-identical": differing_states(*runs),
    }


def infeasible(cell: Cell, _: m.Trajectory) -> str:
    """Send a goal with a duration that is too short for the limits."""
    return refusal_code(lambda: cell.goal(positions=[-1.8, *cell.home[1:]], duration=0.05))


def outside(cell: Cell, _: m.Trajectory) -> str:
    """Send a goal outside the range of the joints."""
    return refusal_code(lambda: cell.goal(positions=[9.0] * len(cell.home)))


def late(cell: Cell, trajectory: m.Trajectory) -> str:
    """Send a plan whose start time has passed, as a slow planner would."""
    epoch = cell.bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=0.0)).epoch
    stale = msgspec.structs.replace(trajectory, epoch=epoch, goal_id=f"late {cell.tick} {cell.run}")
    return refusal_code(lambda: cell.bus.ask(topics.EXECUTE, stale))


def unsolved(cell: Cell, _: m.Trajectory) -> str:
    """Send a goal with active limits, which requires a quadratic program."""
    return refusal_code(lambda: cell.goal(limits=m.GoalLimits(jerks=[JERK for _ in cell.home])))


def failing_solver(lab: Lab) -> Measured:
    """Send goals to a planner whose solver fails on every program."""
    with lab.cell(CellConfig(shims={"planner": shim("failing_solver", lab.folder)})) as cell:
        cell.reset()
        return refuse_at_every_tenth(cell, unsolved)


def bounds(code: str) -> tuple:
    """Return the bounds of requests that must be refused with `code`."""
    return exactly("refusal codes", code), reported("states compared"), none("states not bit-identical")


SCENARIOS = (
    Scenario(
        "goal-infeasible",
        "an infeasible goal, at every tenth of a motion",
        bounds("infeasible"),
        lambda lab: refuse_at_every_tenth(lab.shared_cell(), infeasible),
    ),
    Scenario(
        "goal-outside",
        "a goal outside the range of the joints, at every tenth of a motion",
        bounds("limit"),
        lambda lab: refuse_at_every_tenth(lab.shared_cell(), outside),
    ),
    Scenario(
        "plan-late",
        "a plan that arrives too late, at every tenth of a motion",
        bounds("late"),
        lambda lab: refuse_at_every_tenth(lab.shared_cell(), late),
    ),
    Scenario(
        "solver-failing",
        "a solver that fails on every program, at every tenth of a motion",
        bounds("solver_failed"),
        failing_solver,
    ),
)
