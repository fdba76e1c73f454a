"""What a plan must pass before it is played: its length, collisions, torques."""

from motion.plan import Plan
from protocol import messages as m
from protocol.topics import MAX_PLAN_S
from robot.motion_check import Findings, MotionCheck
from services.planner.goal_checks import too_long


class Verifier:
    """Checks the plans of one goal, and keeps what it found of the last that passed.

    findings: nothing, before a plan passed.
    """

    def __init__(self, motions: MotionCheck, goal: m.Goal, begin: float | None) -> None:
        """Prepare for plans of `goal` that begin at `begin`, s on the robot's clock; None: at no time in particular."""
        self.findings = Findings()
        self._motions = motions
        self._goal = goal
        self._begin = begin

    def __call__(self, plan: Plan) -> None:
        """Check a plan.

        Raises:
            Refusal: it takes longer than a plan may.
            MotionError: Collides or TorqueExceeded.
        """
        if plan.total_duration > MAX_PLAN_S + plan.tick / 2:
            raise too_long(self._goal, plan.duration, plan.total_duration)
        checks = self._goal.checks
        self.findings = self._motions.check(
            plan.trajectory, plan.total_duration, checks.collision, checks.torque, self._begin
        )
