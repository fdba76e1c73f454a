"""Convert goals in tool space to joint space, with the postures found as alternatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from msgspec.structs import replace

from motion.errors import InvalidMotion
from motion.limits import Limits
from motion.primitive import Primitive
from protocol import messages as m
from robot.description import RobotConfig
from robot.kinematics import Kinematics
from robot.tool_target import ToolTarget, Unreachable, rotation_of
from services.planner.goals import Origin, limits_of, planned_duration
from services.planner.refusals import invalid, unreachable

if TYPE_CHECKING:  # importing mink takes a third of a second
    from robot.inverse_kinematics import InverseKinematics


def is_in_tool_space(goal: m.Goal) -> bool:
    """Return whether the goal or one of its waypoints is in tool space."""
    return goal.tool is not None or any(waypoint.tool is not None for waypoint in goal.waypoints)


@dataclass(frozen=True, slots=True, eq=False)
class _End:
    """A posture (J,), rad, and its velocities (J,), rad/s."""

    positions: np.ndarray
    velocities: np.ndarray


class ToolSpace:
    """Converts goals in tool space to goals in joint space."""

    def __init__(self, config: RobotConfig) -> None:
        self._config = config
        self._found: InverseKinematics | None = None

    @property
    def kinematics(self) -> InverseKinematics:
        """The arm's inverse kinematics, created on first use."""
        if self._found is None:
            from robot.inverse_kinematics import InverseKinematics

            self._found = InverseKinematics(self._config)
        return self._found

    def warm_up(self) -> None:
        """Solve for the tool's pose at home, so that the first goal takes no longer than later ones."""
        home = self._config.home
        target = ToolTarget(*Kinematics(self._config).tool_pose(home))
        self.kinematics.postures(target, self._config.limits.positions, [home])

    def in_joint_space(self, goal: m.Goal, primitive: Primitive, origin: Origin) -> tuple[m.Goal, list[int]]:
        """Return the goal in joint space: it ends in the posture nearest to the imitated one or in an alternative.

        Also return, for each end of that goal, the index of the given goal's end: 0 its own, 1 the first alternative.

        Raises:
            Refusal: `unreachable`; and `bad_message` or `invalid_goal` for its limits, `late` for its times.
        """
        try:
            limits = limits_of(goal.limits, self._config)
        except InvalidMotion as error:
            raise invalid(error) from None
        whose = list(range(1 + len(goal.alternatives)))
        if goal.tool is not None:
            found = self._ends(goal.tool, primitive, origin, limits)
            offered = found if goal.method == "qp" and not goal.fastest else found[:1]
            goal, whose = _in_postures(goal, offered)
        waypoints = self._waypoints(goal, primitive, origin, limits)
        return replace(goal, waypoints=waypoints), whose

    def _ends(self, tool: m.ToolGoal, primitive: Primitive, origin: Origin, limits: Limits) -> list[_End]:
        """Return the possible ends of a goal; for a correction, only the one near the corrected posture."""
        start, correction = origin.boundary.positions, origin.correction
        if correction is not None:
            seed = np.array(correction.posture)
        else:
            seed = start + primitive.goal.positions - primitive.start.positions
        seeds = [seed, start, primitive.goal.positions, self._config.home]
        return self._found_ends(tool, "", seeds, limits, only_near=correction is not None)

    def _found_ends(
        self, tool: m.ToolGoal, field: str, seeds: Sequence[np.ndarray], limits: Limits, only_near: bool
    ) -> list[_End]:
        """Return postures with their velocities; with `only_near` only the one near the first seed, if it exists.

        Raises:
            Refusal: `unreachable`, with a sentence that starts with the `field`.
        """
        target = target_of(tool)
        if only_near:
            near = self.kinematics.nearby(target, limits.positions, seeds[0])
            ends, _ = self._moving(target, [] if near is None else [near], limits.velocities)
            if ends:
                return ends
        try:
            postures = self.kinematics.postures(target, limits.positions, seeds)
        except Unreachable as error:
            raise unreachable(error, field) from None
        ends, errors = self._moving(target, postures, limits.velocities)
        if not ends:
            raise unreachable(errors[0], field)
        return ends

    def _moving(
        self, target: ToolTarget, postures: Sequence[np.ndarray], limits: np.ndarray
    ) -> tuple[list[_End], list[Unreachable]]:
        """Return the postures that allow the tool's velocity, and the reasons against the rejected ones."""
        ends: list[_End] = []
        errors: list[Unreachable] = []
        for posture in postures:
            try:
                ends.append(_End(posture, self.kinematics.velocities(target, posture, limits)))
            except Unreachable as error:
                errors.append(error)
        return ends, errors

    def _waypoints(self, goal: m.Goal, primitive: Primitive, origin: Origin, limits: Limits) -> list[m.Waypoint]:
        """Return the waypoints in joint space, near the imitated motion adapted to start, end and earlier waypoints."""
        if not any(waypoint.tool is not None for waypoint in goal.waypoints):
            return goal.waypoints
        duration = planned_duration(goal, primitive, self._config, origin)
        phase = origin.correction.phase if origin.correction else 0.0
        end = primitive.goal.positions if goal.positions is None else np.array(goal.positions)

        def imitated(time: float) -> np.ndarray:
            return primitive.positions(np.clip([phase + (1 - phase) * time / duration], 0, 1))[0]

        knots = {0.0: origin.boundary.positions - imitated(0.0), duration: end - imitated(duration)}
        found: dict[int, m.Waypoint] = {}
        for index, waypoint in sorted(enumerate(goal.waypoints), key=lambda pair: pair[1].time_from_start):
            if waypoint.tool is None:
                found[index] = waypoint
                continue
            time = waypoint.time_from_start
            times = sorted(knots)
            moved = [np.interp(time, times, column) for column in np.array([knots[t] for t in times]).T]
            seeds = [imitated(time) + moved, origin.boundary.positions, end, self._config.home]
            at, *_ = self._found_ends(waypoint.tool, f"waypoints[{index}].", seeds, limits, only_near=True)
            knots[time] = at.positions - imitated(time)
            moves = waypoint.tool.velocity is not None or waypoint.tool.angular_velocity is not None
            velocities = at.velocities.tolist() if moves else None
            found[index] = m.Waypoint(time_from_start=time, positions=at.positions.tolist(), velocities=velocities)
        return [found[index] for index in range(len(found))]


def _in_postures(goal: m.Goal, found: Sequence[_End]) -> tuple[m.Goal, list[int]]:
    """Return the goal with each of its ends in each of the postures found, and the index of the end of each.

    Too many alternatives are reduced to the postures nearest to the imitated one.
    """
    given = [m.Alternative(), *goal.alternatives]
    each = max(m.MAX_ALTERNATIVES // len(given), 1)
    ends = [
        (index, replace(end, positions=posture.positions.tolist(), velocities=posture.velocities.tolist()))
        for index, end in enumerate(given)
        for posture in found[:each]
    ]
    own = ends[0][1]
    posed = replace(goal, tool=None, positions=own.positions, velocities=own.velocities)
    return replace(posed, alternatives=[end for _, end in ends[1:]]), [index for index, _ in ends]


def target_of(tool: m.ToolGoal) -> ToolTarget:
    """Return the target of a goal that has passed `check_goal`."""
    velocity, turning = (None if v is None else np.array(v) for v in (tool.velocity, tool.angular_velocity))
    return ToolTarget(
        position=np.array(tool.position),
        rotation=None if tool.orientation is None else rotation_of(np.array(tool.orientation)),
        axis=None if tool.axis is None else np.array(tool.axis) / np.linalg.norm(tool.axis),
        velocity=np.zeros(3) if velocity is None and turning is not None else velocity,
        angular_velocity=turning,
    )
