"""Goals that must be refused: the running motion is the same to the bit."""

from collections.abc import Callable

import msgspec

from protocol import messages as m
from protocol import topics
from tools.drill.harness.cell import Cell, code_of
from tools.drill.harness.lab import Lab
from tools.drill.harness.shims import shim
from tools.drill.harness.start import CellConfig
from tools.drill.harness.states import differing
from tools.drill.scenario import Measured, Scenario, exactly, none, reported

Ask = Callable[[Cell, m.Trajectory], str]
JERK = 100.0
"""rad/s³; less than a motion of a second has without limits."""


def refuse_at_every_tenth(cell: Cell, ask: Ask) -> Measured:
    """Play a trajectory twice, the second time with a request at every tenth; compare the states' bytes."""
    trajectory = cell.strike(plan_only=True, include_trajectory=True).trajectory
    assert trajectory is not None
    seed, runs, codes = cell.run + 1, [], set()
    for asking in (False, True):
        cell.reset(seed=seed)
        epoch = cell.bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=0.0)).epoch
        played = msgspec.structs.replace(trajectory, epoch=epoch, goal_id=f"{ask.__name__} {asking} {seed}")
        cell.bus.ask(topics.EXECUTE, played)
        for tenth in range(1, 11):
            cell.step_to(20 + 100 * tenth)
            if asking:
                codes.add(ask(cell, trajectory))
        cell.step_to(1500)
        runs.append(cell.state_bodies())
    return {
        "refused as": ", ".join(sorted(codes)),
        "states compared": len(runs[0]),
        "states that differ in a bit": differing(*runs),
    }


def infeasible(cell: Cell, _: m.Trajectory) -> str:
    """Ask for a strike in much too short a time."""
    return code_of(lambda: cell.goal(positions=[-1.8, *cell.home[1:]], duration=0.05))


def outside(cell: Cell, _: m.Trajectory) -> str:
    """Ask for a goal beyond the joints' range."""
    return code_of(lambda: cell.goal(positions=[9.0] * len(cell.home)))


def late(cell: Cell, trajectory: m.Trajectory) -> str:
    """Send a plan whose start has passed, as from a planner that was too slow."""
    epoch = cell.bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=0.0)).epoch
    stale = msgspec.structs.replace(trajectory, epoch=epoch, goal_id=f"late {cell.tick} {cell.run}")
    return code_of(lambda: cell.bus.ask(topics.EXECUTE, stale))


def unsolved(cell: Cell, _: m.Trajectory) -> str:
    """Ask for a motion whose limits bind, so that a quadratic program must be solved."""
    return code_of(lambda: cell.goal(limits=m.GoalLimits(jerks=[JERK for _ in cell.home])))


def failing_solver(lab: Lab) -> Measured:
    """Ask a planner whose solver fails on every program."""
    with lab.cell(CellConfig(shims={"planner": shim("failing_solver", lab.folder)})) as cell:
        cell.reset()
        return refuse_at_every_tenth(cell, unsolved)


def bounds(code: str) -> tuple:
    """Return the bounds of refusals with a code."""
    return exactly("refused as", code), reported("states compared"), none("states that differ in a bit")


SCENARIOS = (
    Scenario(
        "goal-infeasible",
        "an infeasible goal, at every tenth of a motion",
        "stepped",
        bounds("infeasible"),
        lambda lab: refuse_at_every_tenth(lab.shared(), infeasible),
    ),
    Scenario(
        "goal-outside",
        "a goal outside the range of the joints, at every tenth of a motion",
        "stepped",
        bounds("limit"),
        lambda lab: refuse_at_every_tenth(lab.shared(), outside),
    ),
    Scenario(
        "plan-late",
        "a plan that comes too late, at every tenth of a motion",
        "stepped",
        bounds("late"),
        lambda lab: refuse_at_every_tenth(lab.shared(), late),
    ),
    Scenario(
        "solver-failing",
        "a solver that fails on every program, at every tenth of a motion",
        "stepped",
        bounds("solver_failed"),
        failing_solver,
    ),
)
