"""Curves of accepted plans, written as time passes, so that replaced parts of a plan are never written."""

from collections import deque
from dataclasses import dataclass

import numpy as np
import rerun as rr

from protocol import messages as m
from protocol.codec import matrix
from robot.conversions import samples_of
from services.common.ticks import tick_of
from services.recorder import entities
from services.recorder.context import Context
from services.recorder.limits import Limits, limits_by_quantity
from services.recorder.writer import Rows

STOPPED_GOALS = 64
"""Largest number of stopped goals that are stored until their plans arrive."""


@dataclass(slots=True, eq=False)
class PlannedMotion:
    """A plan of N samples that is being written.

    Attributes:
        goal_id: Goal of the motion.
        corrects: Whether it corrects another motion; a gap of one tick is left between their curves.
        ticks: (N,), of the trace.
        curves: By quantity (N, J).
        demonstration: (M, J), M ≤ N, rad.
        target_ticks: (K,), of the trace.
        targets: (K, J), goal and waypoints, rad, NaN for a free joint.
        limits: Limits of the plan.
        end: Tick from which nothing is written.
        written: Tick up to which everything is written.
    """

    goal_id: str
    corrects: bool
    ticks: np.ndarray
    curves: dict[str, np.ndarray]
    demonstration: np.ndarray
    target_ticks: np.ndarray
    targets: np.ndarray
    limits: Limits
    end: int
    written: int = -1

    @property
    def begin(self) -> int:
        """The tick of its first sample."""
        return int(self.ticks[0])


def planned_motion(plan: m.Plan, context: Context) -> PlannedMotion:
    """Convert a plan to trace ticks of the present run."""
    joints, first = len(context.names), context.runs.tick_ahead(plan.start_time)
    motion = samples_of(plan)
    demonstrated = plan.hit_index + 1 if plan.demonstration else 0
    ticks = first + np.rint(np.arange(plan.count) * plan.dt * context.rate_hz).astype(np.int64)
    points = [(w.time_from_start, w.positions) for w in plan.waypoints if w.positions is not None]
    points.append((plan.hit_index * plan.dt, motion.positions[plan.hit_index].tolist()))
    return PlannedMotion(
        goal_id=plan.goal_id,
        corrects=plan.revises is not None,
        ticks=ticks,
        curves={"position": motion.positions, "velocity": motion.velocities, "acceleration": motion.accelerations},
        demonstration=matrix(plan.demonstration, demonstrated, joints, "demonstration"),
        target_ticks=first + np.array([tick_of(time, context.rate_hz) for time, _ in points]),
        targets=np.array([values for _, values in points], dtype=float),  # a free joint's null becomes NaN
        limits=limits_by_quantity(plan.limits),
        end=int(ticks[-1]) + 1,
    )


class PlannedCurves:
    """Writes the curves of the motions that have not ended."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._motions: list[PlannedMotion] = []
        self._stopped: deque[str] = deque(maxlen=STOPPED_GOALS)

    def add(self, motion: PlannedMotion) -> None:
        """Add a motion; the curves of all earlier ones end at its start."""
        gap = motion.begin - 1 if motion.corrects else motion.begin
        for before in self._motions:
            before.end = min(before.end, gap)
        self._motions = [before for before in self._motions if before.begin < before.end]
        if motion.corrects:
            self._break_curves(gap)
            row = Rows(motion.ticks[:1], self._context.rate_hz)
            first = motion.curves["position"][:1]
            self._context.trace.joints(entities.CORRECTED, self._context.names, row, first)
        self._motions.append(motion)
        if motion.goal_id in self._stopped:
            self._stopped.remove(motion.goal_id)
            self.end(motion.goal_id)

    def end_before(self, tick: int) -> None:
        """End, at `tick`, the motions that begin before it."""
        for motion in self._motions:
            if motion.begin < tick:
                motion.end = min(motion.end, tick)

    def end(self, goal_id: str) -> None:
        """End a motion now, or when its plan arrives."""
        stopped = [motion for motion in self._motions if motion.goal_id == goal_id]
        for motion in stopped:
            motion.end = min(motion.end, self._context.runs.newest + 1)
        if not stopped:
            self._stopped.append(goal_id)

    def write_until(self, newest: int) -> list[tuple[int, Limits | None]]:
        """Write all curves up to the tick `newest`. Return the ticks at which limits change, with the new limits.

        None stands for the robot's limits, after the end of a motion without a successor.
        """
        changes: list[tuple[int, Limits | None]] = []
        for motion, following in zip(self._motions, [*self._motions[1:], None], strict=False):
            until = min(newest, motion.end - 1)
            if motion.written < 0 and motion.begin <= until:
                changes.append((motion.begin, motion.limits))
            self._write(motion, until)
            if motion.written >= 0 and motion.end <= newest and not _goes_on(motion, following):
                self._break_curves(motion.end)
                changes.append((motion.end, None))
        self._motions = [motion for motion in self._motions if motion.end > newest]
        return changes

    def _write(self, motion: PlannedMotion, until: int) -> None:
        """Write the rest of a motion, up to `until`."""
        chosen = np.flatnonzero((motion.ticks > motion.written) & (motion.ticks <= until))
        if not len(chosen):
            return
        context, trace = self._context, self._context.trace
        rows = Rows(motion.ticks[chosen], context.rate_hz)
        for quantity, values in motion.curves.items():
            trace.joints(entities.PLANNED[quantity], context.names, rows, values[chosen])
        shown = chosen[chosen < len(motion.demonstration)]
        if len(shown):
            at = Rows(motion.ticks[shown], context.rate_hz)
            trace.joints(entities.DEMONSTRATED, context.names, at, motion.demonstration[shown])
        self._write_targets(motion, until)
        motion.written = until

    def _write_targets(self, motion: PlannedMotion, until: int) -> None:
        for tick, values in zip(motion.target_ticks.tolist(), motion.targets, strict=True):
            if motion.written < tick <= until:
                row = Rows([tick], self._context.rate_hz)
                for name, value in zip(self._context.names, values.tolist(), strict=True):
                    if np.isfinite(value):
                        self._context.trace.scalars(entities.TARGET.at(name), row, [value])

    def _break_curves(self, tick: int) -> None:
        """Write an empty value at `tick`, so that no line joins a plan's curves to the next one's."""
        row, nothing = Rows([tick], self._context.rate_hz), rr.Scalars.columns(scalars=[]).partition([0])
        for name in self._context.names:
            for entity in (*entities.PLANNED.values(), entities.DEMONSTRATED):
                self._context.trace.send(entity.at(name), row, nothing)


def _goes_on(motion: PlannedMotion, following: PlannedMotion | None) -> bool:
    """Return whether the next motion follows without a gap, or after one tick for a correction."""
    return following is not None and following.begin <= motion.end + 1
