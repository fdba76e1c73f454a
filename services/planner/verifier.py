"""Checks of a plan before it is played: duration, collisions, torques."""

from motion.plan import Plan
from protocol import messages as m
from protocol.topics import MAX_PLAN_S
from robot.motion_check import Findings, MotionCheck
from services.planner.goal_checks import too_long


class Verifier:
    """Checks the plans of one goal, and keeps the findings of the last valid plan.

    findings: empty before a plan has passed.
    """

    def __init__(self, motions: MotionCheck, goal: m.Goal, begin: float | None) -> None:
        """Prepare for plans of `goal` that start at `begin`, s on the robot's clock; None: at an unknown time."""
        self.findings = Findings()
        self._motions = motions
        self._goal = goal
        self._begin = begin

    def __call__(self, plan: Plan) -> None:
        """Check a plan.

        Raises:
            Refusal: the plan is too long.
            MotionError: Collides or TorqueExceeded.
        """
        if plan.total_duration > MAX_PLAN_S + plan.tick / 2:
            raise too_long(self._goal, plan.duration, plan.total_duration)
        checks = self._goal.checks
        self.findings = self._motions.check(
            plan.trajectory, plan.total_duration, checks.collision, checks.torque, self._begin
        )
