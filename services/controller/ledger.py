"""The goals the controller has taken on, and how each went."""

from collections import OrderedDict
from dataclasses import dataclass, field

import numpy as np

from protocol import messages as m
from protocol.errors import Refusal

KEPT = 1000


@dataclass(slots=True)
class Running:
    """A goal under way: its ticks, and how it will have ended if nothing else comes (`closing`).

    `hit` is None where a stop keeps the arm from reaching it.
    """

    result: m.Result
    client_id: str
    lease: bool
    start: int
    hit: int | None
    end: int
    closing: m.Outcome = "succeeded"
    reason: str = ""


@dataclass(slots=True)
class Ledger:
    """Goals in the order they were accepted; the last 1000 results are kept."""

    active: list[Running] = field(default_factory=list)
    ended: list[m.Result] = field(default_factory=list)
    _results: OrderedDict[str, m.Result] = field(default_factory=OrderedDict)

    def open(self, goal: Running) -> None:
        """Take on `goal`, which will replace the others from its start on."""
        self.active.append(goal)
        self._results[goal.result.goal_id] = goal.result
        while len(self._results) > KEPT:
            self._results.popitem(last=False)

    def close_due(self, tick: int) -> bool:
        """End every goal that is over at `tick`: replaced by its successor, or played to its end."""
        still = []
        for index, goal in enumerate(self.active):
            successor = min(self.active[index + 1 :], key=lambda later: later.start, default=None)
            replaced = successor is not None and tick >= successor.start
            if successor and replaced and goal.closing == "succeeded":
                reason = f"goal {successor.result.goal_id} took over"
                self._end(goal, "preempted" if goal.result.hit is None else "succeeded", reason)
            elif replaced or tick >= goal.end:
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
        """Let every goal end with `outcome` at `tick`, its plan left at `leaves`, unless it was closing otherwise."""
        for goal in self.active:
            if goal.closing == "succeeded":
                goal.closing, goal.reason, goal.end = outcome, reason, tick
                if goal.hit is not None and goal.hit > leaves:
                    goal.hit = None

    def current(self, tick: int) -> Running | None:
        """Return the goal whose motion is played at `tick`."""
        begun = [goal for goal in self.active if goal.start <= tick]
        return begun[-1] if begun else None

    def result(self, goal_id: str) -> m.Result:
        """Return how `goal_id` went so far.

        Raises:
            Refusal: `unknown_goal`.
        """
        try:
            return self._results[goal_id]
        except KeyError:
            sentence = f"goal_id {goal_id!r} is not among the last {KEPT} goals this controller accepted"
            raise Refusal("unknown_goal", sentence, goal_id=goal_id) from None

    def knows(self, goal_id: str) -> bool:
        """Return whether a goal of that name was accepted."""
        return goal_id in self._results

    def take_ended(self) -> list[m.Result]:
        """Return the results that became final since the last call."""
        ended, self.ended = self.ended, []
        return ended

    def _end(self, goal: Running, outcome: m.Outcome, reason: str) -> None:
        goal.result.outcome, goal.result.reason = outcome, reason
        self.ended.append(goal.result)


def note_hit(result: m.Result, time: float, reference: tuple[np.ndarray, ...], state: m.State) -> None:
    """Write the errors of `state` against the reference (positions, velocities, …) at the hit into `result`."""
    positions, velocities = reference[0], reference[1]
    truth = state.truth
    result.hit = m.Hit(
        time=time,
        position_error=(np.array(state.positions) - positions).tolist(),
        velocity_error=(np.array(state.velocities) - velocities).tolist(),
        truth_error=truth
        and m.Point(
            positions=(np.array(truth.positions) - positions).tolist(),
            velocities=(np.array(truth.velocities) - velocities).tolist(),
        ),
    )
