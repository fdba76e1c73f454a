"""The goals that the controller accepted, and their results."""

from bisect import bisect_left, bisect_right
from collections import OrderedDict
from collections.abc import Container
from dataclasses import dataclass, field
from itertools import zip_longest

import numpy as np

from protocol import messages as m
from protocol.codec import check_id
from protocol.errors import Refusal
from robot.description import RobotConfig
from robot.surroundings import BALL
from services.controller.checks import Checked
from services.controller.hit_tolerance import HitTolerance, tolerance_of
from services.controller.timeline import Segment

KEPT = 1000
MOST_SAMPLES = 600_000
"""Limit on the samples of accepted motions, ten minutes at 1 kHz: about 100 MB for six joints."""


@dataclass(slots=True)
class ActiveGoal:
    """A running goal.

    Attributes:
        start: Tick at which its motion starts.
        hit: Tick of its hit; None if a stop prevents the hit.
        swings: Whether the reference moves at the hit.
        touched: Tick of the arm's first contact with the ball.
        end: Tick at which the goal ends with the outcome `closing`, for `reason`, unless it ends earlier.
        tolerance: Decides whether the hit was a miss; None: never.
    """

    result: m.Result
    client_id: str
    lease: bool
    start: int
    hit: int | None
    end: int
    closing: m.Outcome = "succeeded"
    reason: str = ""
    tolerance: HitTolerance | None = None
    swings: bool = False
    touched: int | None = None

    def follow(self, state: m.State, reference: tuple[np.ndarray, ...], error: float, now_ns: int) -> None:
        """Update the result from `state` and its `reference` (positions, velocities, …); `error`: largest one, rad."""
        result, stamps = self.result, self.result.stamps
        result.peak_tracking_error = max(result.peak_tracking_error, error)
        result.saturated_ticks += any(state.saturated)
        if stamps.first_command is None:
            result.stamps = m.Stamps(stamps.requested, stamps.planned, stamps.accepted, now_ns)
        if result.hit is None and self.hit is not None and self.hit <= state.tick:
            measured = error_of(state, reference)
            result.hit = m.Hit(
                time=state.time,
                position_error=measured.positions,
                velocity_error=measured.velocities,
                truth_error=state.truth and error_of(state.truth, reference),
            )


def active_goal(checked: Checked, config: RobotConfig, now_ns: int) -> ActiveGoal:
    """Return the goal of a trajectory accepted at `now_ns`, Unix time."""
    trajectory, segment = checked.message, checked.segment
    stamps = m.Stamps(requested=trajectory.stamps.requested, planned=trajectory.stamps.planned, accepted=now_ns)
    return ActiveGoal(
        result=m.Result(goal_id=trajectory.goal_id, outcome="running", stamps=stamps),
        client_id=trajectory.client_id,
        lease=trajectory.lease,
        start=segment.start,
        hit=segment.start + trajectory.hit_index,
        end=segment.end,
        tolerance=tolerance_of(trajectory, config),
        swings=bool(segment.samples.velocities[trajectory.hit_index].any()),
    )


def error_of(point: m.State | m.Point, reference: tuple[np.ndarray, ...]) -> m.Point:
    """Return `point` minus its `reference` (positions, velocities, …), rad and rad/s."""
    return m.Point(
        positions=(np.array(point.positions) - reference[0]).tolist(),
        velocities=(np.array(point.velocities) - reference[1]).tolist(),
    )


@dataclass(slots=True)
class Ledger:
    """Goals in the order of acceptance, each of which starts after the one before; the last 1000 results are kept."""

    active: list[ActiveGoal] = field(default_factory=list)
    ended: list[m.Result] = field(default_factory=list)
    _results: OrderedDict[str, m.Result] = field(default_factory=OrderedDict)

    def admit(self, trajectory: m.Trajectory, clients: Container[str]) -> None:
        """Check that `trajectory` may replace the present motion; `clients` are holders of their liveliness tokens.

        Raises:
            Refusal: `duplicate`, `not_holder` or `busy`.
        """
        goal_id = trajectory.goal_id
        if self.knows(goal_id):
            raise Refusal("duplicate", f"goal_id {goal_id!r} was executed before; make a new one", goal_id=goal_id)
        holder = next((goal.client_id for goal in self.active if goal.lease), trajectory.client_id)
        if holder != trajectory.client_id:
            sentence = f"client {holder!r} holds the arm until its motion ends; cancel is open to all"
            raise Refusal("not_holder", sentence, client_id=holder)
        if trajectory.lease and holder not in clients:
            sentence = f"client {holder!r} asks for a lease without the token that keeps it: hold alive/client/{holder}"
            raise Refusal("not_holder", sentence, client_id=holder)
        if self.active and not trajectory.preempt:
            running = self.active[-1].result.goal_id
            raise Refusal("busy", f"goal {running} is under way and preempt is false; wait for it", goal_id=running)

    def check_room(self, segment: Segment, config: RobotConfig) -> None:
        """Check that the goals that begin before `segment` leave room for its samples.

        Raises:
            Refusal: `busy`.
        """
        waiting = sum(goal.end - goal.start + 1 for goal in self.active if goal.start < segment.start)
        if waiting and waiting + len(segment.samples) > MOST_SAMPLES:
            seconds = waiting * config.tick
            sentence = f"motions of {seconds:.0f} s wait already; send this one once some of them were played"
            raise Refusal("busy", sentence, goal_id=self.active[-1].result.goal_id)

    def open(self, goal: ActiveGoal) -> None:
        """Add `goal`, which replaces all earlier goals from its start on; later ones end now."""
        kept = bisect_left(self.active, goal.start, key=lambda known: known.start)
        for replaced in self.active[kept:]:
            self._end_replaced(replaced, goal)
        self.active[kept:] = [goal]
        self._results[goal.result.goal_id] = goal.result
        while len(self._results) > KEPT:
            self._results.popitem(last=False)

    def close_due(self, tick: int) -> bool:
        """End every goal that is replaced or played to its end at `tick`; return whether there was one."""
        still = []
        for goal, successor in zip_longest(self.active, self.active[1:]):
            if successor is not None and tick >= successor.start:
                self._end_replaced(goal, successor)
            elif tick >= goal.end:
                self._end(goal, goal.closing, goal.reason)
            else:
                still.append(goal)
        changed = len(still) < len(self.active)
        self.active = still
        return changed

    def close_all(self, outcome: m.Outcome, reason: str) -> None:
        """End every goal now."""
        for goal in self.active:
            self._end(goal, outcome, reason)
        self.active = []

    def close_later(self, leaves: int, tick: int, outcome: m.Outcome, reason: str) -> None:
        """End every goal with `outcome` at `tick`, its plan left at `leaves`, unless it already ends early."""
        for goal in self.active:
            if goal.closing == "succeeded":
                goal.closing, goal.reason, goal.end = outcome, reason, tick
                if goal.hit is not None and goal.hit > leaves:
                    goal.hit = None

    def current(self, tick: int) -> ActiveGoal | None:
        """Return the goal whose motion is played at `tick`, or None."""
        begun = bisect_right(self.active, tick, key=lambda goal: goal.start)
        return self.active[begun - 1] if begun else None

    def played_at(self, tick: int) -> str | None:
        """Return the id of the goal whose motion is played at `tick`, or None at rest and during a stop."""
        goal = self.current(tick)
        return goal.result.goal_id if goal and tick < goal.end and goal.closing == "succeeded" else None

    def result(self, goal_id: str) -> m.Result:
        """Return the result of `goal_id` so far.

        Raises:
            Refusal: `unknown_goal`; `bad_message` for an id that no goal can have.
        """
        check_id("goal_id", goal_id)
        try:
            return self._results[goal_id]
        except KeyError:
            among = f"the last {KEPT} goals this controller accepted; a refused goal has no result"
            sentence = f"goal_id {goal_id!r} is not among {among}"
            raise Refusal("unknown_goal", sentence, goal_id=goal_id) from None

    def knows(self, goal_id: str) -> bool:
        """Return whether a goal with this id was accepted."""
        return goal_id in self._results

    def take_ended(self) -> list[m.Result]:
        """Return the results that became final since the last call."""
        ended, self.ended = self.ended, []
        return ended

    def note_touch(self, touch: m.FirstContact, tick: int) -> None:
        """Store the arm's first contact, and its first contact with the ball, during the motion played at `tick`."""
        goal = self.current(tick)
        if goal is None:
            return
        if goal.result.first_contact is None:
            goal.result.first_contact = touch
        if goal.touched is None and touch.other == BALL:
            goal.touched = tick

    def _end_replaced(self, goal: ActiveGoal, successor: ActiveGoal) -> None:
        if goal.closing == "succeeded":
            outcome = "preempted" if goal.result.hit is None else "succeeded"
            self._end(goal, outcome, f"goal {successor.result.goal_id} took over")
        else:
            self._end(goal, goal.closing, goal.reason)

    def _end(self, goal: ActiveGoal, outcome: m.Outcome, reason: str) -> None:
        hit = goal.result.hit
        if outcome == "succeeded" and hit and goal.tolerance and (missed := goal.tolerance.miss(hit)):
            outcome, reason = "missed", missed
        goal.result.outcome, goal.result.reason = outcome, reason
        self.ended.append(goal.result)
