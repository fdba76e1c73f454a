"""Writers of accepted plans: facts, the tool's path, curves, and the limits in force."""

import math

import numpy as np
import rerun as rr

from protocol import messages as m
from services.recorder import entities
from services.recorder.context import Context
from services.recorder.limits import LimitsInForce
from services.recorder.planned_curves import PlannedCurves, PlannedMotion, planned_motion
from services.recorder.validation import Received

PATH_EVERY_S = 0.01
PLANNED, DEMONSTRATED, HIT = (110, 190, 110), (150, 150, 160), (235, 64, 52)


class PlanWriter:
    """Writes each plan's facts and paths at once, and its curves and limits as time passes."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._curves = PlannedCurves(context)
        self._limits = LimitsInForce(context)
        trace = context.trace
        path = rr.LineStrips3D.from_fields(colors=PLANNED, radii=0.004)
        trace.static(entities.PLANNED_PATH.path, path)
        shown = rr.LineStrips3D.from_fields(colors=DEMONSTRATED, radii=0.002)
        trace.static(entities.DEMONSTRATED_PATH.path, shown)
        hit = rr.Points3D.from_fields(colors=HIT, radii=rr.Radius.ui_points(6.0), labels=["hit"])
        trace.static(entities.PLANNED_HIT.path, hit)

    def write(self, received: list[Received[m.Plan]]) -> None:
        """Add new plans, and write curves and limits up to now."""
        self._curves.end_before(self._context.runs.offset)  # a new run ends the plans of the last one
        for one in received:
            motion = planned_motion(one.message, self._context)
            self._write_facts(one, motion)
            self._write_paths(one, motion)
            self._curves.add(motion)
        newest = self._context.runs.newest
        if newest >= 0:
            for tick, limits in self._curves.write_until(newest):
                self._limits.change(tick, limits)
            self._limits.write_until(newest)

    def end(self, goal_id: str) -> None:
        """End the curves of a stopped motion, even if its plan arrives later."""
        self._curves.end(goal_id)

    def _write_facts(self, one: Received[m.Plan], motion: PlannedMotion) -> None:
        plan, row = one.message, self._context.row_at(one.wall_ns)
        through = f", through {len(plan.waypoints)} waypoint(s)" if plan.waypoints else ""
        corrects = f", corrects {plan.revises} at phase {plan.phase:.3f}" if plan.revises is not None else ""
        sentence = (
            f"plan {plan.goal_id} ({plan.primitive}) accepted{corrects}: starts at {plan.start_time:.3f} s of its run, "
            f"hits {plan.hit_index * plan.dt:.3f} s later, at rest after {(plan.count - 1) * plan.dt:.3f} s"
            f"{through}{_space(plan)}"
        )
        self._context.event(entities.GOAL_EVENT, row, sentence)
        self._context.trace.values(
            entities.PLANS.path,
            row,
            goal_id=[plan.goal_id],
            primitive=[plan.primitive],
            start_time=[plan.start_time],
            epoch=[plan.epoch],
            revises=[plan.revises or ""],
            phase=[float(plan.phase)],
            deviation=[_deviation(motion)],
            clearance=[plan.clearance.distance if plan.clearance else math.nan],
            torque_use=[_largest(plan)],
        )

    def _write_paths(self, one: Received[m.Plan], motion: PlannedMotion) -> None:
        """Write the tool's planned path, its position at the hit, and its demonstrated path."""
        trace, tool_path, plan = self._context.trace, self._context.scene.tool_path, one.message
        row, stride = self._context.row_at(one.wall_ns), max(1, round(PATH_EVERY_S / plan.dt))
        positions = motion.curves["position"]
        planned, shown = tool_path(positions[::stride]), tool_path(motion.demonstration[::stride])
        hit = tool_path(positions[plan.hit_index : plan.hit_index + 1])
        trace.send(entities.PLANNED_PATH.path, row, rr.LineStrips3D.columns(strips=[planned]))
        trace.send(entities.DEMONSTRATED_PATH.path, row, rr.LineStrips3D.columns(strips=[shown]))
        trace.send(entities.PLANNED_HIT.path, row, rr.Points3D.columns(positions=hit))


def _space(plan: m.Plan) -> str:
    """Return the planner's findings on distances and torques, as the rest of a sentence."""
    near, largest = plan.clearance, _largest(plan)
    distance = f", {near.body} {near.distance:.3f} m from {near.other} at the nearest" if near else ""
    return distance + (f", up to {100 * largest:.0f} % of a joint's torque" if largest >= 0 else "")


def _deviation(motion: PlannedMotion) -> float:
    """Return the largest distance (rad) of a joint from the demonstration, NaN if unknown."""
    shown = motion.demonstration
    return float(np.abs(motion.curves["position"][: len(shown)] - shown).max(initial=0.0)) if len(shown) else math.nan


def _largest(plan: m.Plan) -> float:
    """Return the largest used fraction of a joint's torque limit, NaN if unknown."""
    return max((use for use in plan.torque_use or [] if use is not None), default=math.nan)
