"""State and plans of another robot in this robot's model, from the bus."""

import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.topics import MIB
from robot.conversions import samples_of
from robot.other_motions import OtherMotion, PlannedMotion
from services.common.other_robots import received

PLANS = 8
"""Capacity for plans that arrive between two goals of this robot: corrections of one motion."""

SOONEST_S = 1.0
"""A plan that starts later than this after the newest state belongs to an earlier run."""

STALE_S = 0.5
"""Age of the newest status above which a robot's motion is unknown."""

LARGEST = 8 * MIB
"""Largest size of a plan, bytes: 20 s of ten joints."""


class OtherRobot:
    """Another robot: its newest state and status, and its present plans.

    joints: names in this robot's model. positions: last received ones, rad.
    """

    def __init__(self, bus: Bus, joints: tuple[str, ...]) -> None:
        """Subscribe to the robot of `bus`, whose vectors are in the order of `joints`."""
        self.joints = joints
        self.positions: list[float] = [0.0] * len(joints)
        self._state: m.State | None = None
        self._status: m.Status | None = None
        self._plans: list[m.Plan] = []
        self._states, self._statuses = bus.collect(topics.STATE, 1), bus.collect(topics.STATUS, 1)
        self._published = bus.collect(topics.PLAN, PLANS)

    def update(self) -> bool:
        """Process the messages since the last call; return whether a plan is among them."""
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
        """Return its predicted motion; `time` (s) is the present time on this robot's clock.

        The newest states relate the two clocks, which are assumed to run at the same rate from then on.
        """
        if self._state is None or self._status is None:
            return OtherMotion(np.array(self.positions))
        self._plans = in_force(self._plans, self._state.time, self._status)
        behind = time - self._state.time
        planned = [PlannedMotion(plan.start_time + behind, plan.dt, samples_of(plan)) for plan in self._plans]
        return OtherMotion(np.array(self.positions), planned)


def in_force(plans: list[m.Plan], time: float, status: m.Status) -> list[m.Plan]:
    """Return the plans that a controller plays at `time` (s) or later, from plans in the order of acceptance.

    The status may be some ms older. If it names a motion whose plan is not known yet, the last known plan is used.
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
