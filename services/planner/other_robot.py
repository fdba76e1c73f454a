"""Another robot that stands in this robot's model, as it is seen on the bus."""

import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.topics import MIB
from robot.conversions import samples_of
from robot.other_motions import OtherMotion, PlannedMotion
from services.common.other_robots import received

PLANS = 8
"""Plans that are kept, of those that are accepted between two goals of this robot: corrections of one motion."""

SOONEST_S = 1.0
"""A plan that begins later than this after the newest state belongs to an earlier run."""

STALE_S = 0.5
"""Age of a status without which nothing is known of a robot's motion."""

LARGEST = 8 * MIB
"""Bytes of a plan: 20 s of ten joints."""


class OtherRobot:
    """Its newest state and status, and its plans that are in force.

    joints: names in this robot's model. positions: where it was seen last, rad.
    """

    def __init__(self, bus: Bus, joints: tuple[str, ...]) -> None:
        """Listen to the robot of `bus`, whose vectors are in the order of `joints`."""
        self.joints = joints
        self.positions: list[float] = [0.0] * len(joints)
        self._state: m.State | None = None
        self._status: m.Status | None = None
        self._plans: list[m.Plan] = []
        self._states, self._statuses = bus.collect(topics.STATE, 1), bus.collect(topics.STATUS, 1)
        self._published = bus.collect(topics.PLAN, PLANS)

    def look(self) -> bool:
        """Take what came since the last call; return whether a plan is among it."""
        for state in received(self._states, m.State):
            if len(state.positions) == len(self.joints):
                if self._state is not None and state.run != self._state.run:
                    self._plans.clear()
                self._state, self.positions = state, state.positions
        for status in received(self._statuses, m.Status):
            self._status = status
        plans = received(self._published, m.Plan, PLANS, LARGEST)
        new = [plan for plan in plans if len(plan.joint_names) == len(self.joints)]
        self._plans = (self._plans + new)[-PLANS:]
        return bool(new)

    def motion(self, time: float) -> OtherMotion:
        """Return where it will be, where this robot's clock shows `time` (s) now.

        By the newest states of both clocks; they run alike from then on.
        """
        if self._state is None or self._status is None:
            return OtherMotion(np.array(self.positions))
        self._plans = in_force(self._plans, self._state.time, self._status)
        behind = time - self._state.time
        planned = [PlannedMotion(plan.start_time + behind, plan.dt, samples_of(plan)) for plan in self._plans]
        return OtherMotion(np.array(self.positions), planned)


def in_force(plans: list[m.Plan], time: float, status: m.Status) -> list[m.Plan]:
    """Return the plans that a controller plays at `time` (s) or will play, of some in the order of their acceptance.

    The status may be some ms older. If it tracks a motion that is not known yet, the last known one stands for it.
    """
    if not plans or time - status.time > STALE_S:
        return []
    newest = plans[-1]
    stopped = status.mode != "tracking" and status.time >= newest.start_time
    if stopped or not time - newest.dt * newest.count < newest.start_time < time + SOONEST_S:
        return []
    found = [newest]
    for plan in reversed(plans[:-1]):
        if found[0].start_time <= time or plan.epoch + 1 != found[0].epoch:
            break
        found.insert(0, plan)
    return found
