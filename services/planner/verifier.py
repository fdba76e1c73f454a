"""What a plan must pass before it is played: its length, collisions, torques."""

import time

from motion.plan import Plan
from protocol import messages as m
from protocol.topics import MAX_PLAN_S
from robot.motion_check import Findings, MotionCheck
from services.planner.goal_checks import too_long

LEAST_CHECK_S = 1e-3
"""A correction that is late already is checked for so long all the same, its nearest future first."""


class Verifier:
    """Checks the plans of one goal, and keeps what it found of the last that passed.

    findings: nothing, before a plan passed.
    """

    def __init__(self, motions: MotionCheck, goal: m.Goal, begin: float | None, deadline: float) -> None:
        """Prepare for plans of `goal` that begin at `begin`, s on the robot's clock; None: at no time in particular.

        Beyond the `deadline` (of `time.perf_counter`) the rest of a plan is not checked.
        """
        self.findings = Findings()
        self._motions = motions
        self._goal = goal
        self._begin = begin
        self._deadline = deadline

    def __call__(self, plan: Plan) -> None:
        """Check a plan.

        Raises:
            Refusal: it takes longer than a plan may.
            MotionError: Collides or TorqueExceeded.
        """
        if plan.total_duration > MAX_PLAN_S + plan.tick / 2:
            raise too_long(self._goal, plan.duration, plan.total_duration)
        deadline = max(self._deadline, time.perf_counter() + LEAST_CHECK_S)
        checks = self._goal.checks
        self.findings = self._motions.check(
            plan.trajectory, plan.total_duration, checks.collision, checks.torque, deadline, self._begin
        )
