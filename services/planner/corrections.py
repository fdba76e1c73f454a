"""Motions that the planner sent to the controller, for goals that correct a running one."""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

from protocol import messages as m
from protocol.errors import Refusal

KEPT = 1000
LONGEST_LEAD_S = 10.0
"""Time within which every accepted motion starts: planning never takes longer."""


@dataclass(frozen=True, slots=True)
class Correction:
    """Start of a correction: the demonstration's phase at the splice, and the time of the hit on the robot's clock.

    A goal with its own time replaces the time of the hit. `posture`: joint positions at the hit, rad.
    """

    phase: float
    hit_time: float
    posture: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Played:
    """An accepted motion. `chain` is the goal of the first motion in its chain of corrections."""

    chain: str
    primitive: str
    start_time: float
    hit_time: float
    phase: float
    posture: tuple[float, ...]

    def phase_at(self, time: float) -> float:
        """Return the demonstration's phase at a time of the motion, linear from its first phase to 1."""
        return self.phase + (1 - self.phase) * (time - self.start_time) / (self.hit_time - self.start_time)


class Corrections:
    """The newest accepted motions by goal_id.

    The least recently played or corrected motion is dropped first, so the first goal of a long chain of corrections
    stays known while corrections name it.
    """

    def __init__(self) -> None:
        self._played: OrderedDict[str, _Played] = OrderedDict()

    def note(
        self, goal: m.Goal, goal_id: str, start_time: float, duration: float, phase: float, posture: Sequence[float]
    ) -> None:
        """Add a motion that the controller accepted; `duration`: to the hit, s; `posture`: (J,) at the hit, rad."""
        revised = self._played.get(goal.revises or "")
        chain = revised.chain if revised else goal_id
        if goal.revises in self._played:
            self._played.move_to_end(goal.revises)
        self._played[goal_id] = _Played(chain, goal.primitive, start_time, start_time + duration, phase, tuple(posture))
        while len(self._played) > KEPT:
            self._played.popitem(last=False)

    def until_begin(self, goal: m.Goal, reference: m.Reference) -> float:
        """Return the time (s) from `reference` to the start of the motion that `goal` corrects, 0 if it runs.

        A motion that starts later than any accepted one could is of an earlier run, and never starts.
        """
        revised, current = self._played.get(goal.revises or ""), self._played.get(reference.goal_id or "")
        if revised is None or (current is not None and current.chain == revised.chain):
            return 0.0
        starts = [played.start_time for played in self._played.values() if played.chain == revised.chain]
        ahead = (start - reference.time for start in starts)
        return min((time for time in ahead if 0 < time <= LONGEST_LEAD_S), default=0.0)

    def correction(self, goal: m.Goal, reference: m.Reference) -> Correction | None:
        """Return phase, hit and posture with which `goal` continues at the `reference`, or None for no correction.

        Raises:
            Refusal: `unknown_goal`, `invalid_goal` for another primitive, `late` if the hit has passed at the splice,
                `superseded` if the motion was replaced or stopped.
        """
        if goal.revises is None:
            return None
        revised = self._played.get(goal.revises)
        if revised is None:
            sentence = f"this planner has sent no motion of goal {goal.revises!r}; send the goal without `revises`"
            raise Refusal("unknown_goal", sentence, goal_id=goal.revises)
        if revised.primitive != goal.primitive:
            sentence = f"goal {goal.revises!r} plays {revised.primitive!r}; a correction must play the same primitive"
            raise Refusal("invalid_goal", sentence, field="primitive")
        current = self._played.get(reference.goal_id or "")
        if current is None or current.chain != revised.chain:
            current = None
        hit_time = (current or self._newest(revised.chain)).hit_time
        if hit_time <= reference.time:
            sentence = (
                f"the hit of goal {goal.revises!r} was due at {hit_time:.3f} s, but a correction can begin at "
                f"{reference.time:.3f} s at the earliest; send the goal without `revises`"
            )
            raise Refusal("late", sentence, goal_id=goal.revises)
        if current is None:
            sentence = f"the motion of goal {goal.revises!r} was replaced or stopped; send the goal without `revises`"
            raise Refusal("superseded", sentence, goal_id=goal.revises)
        return Correction(current.phase_at(reference.time), current.hit_time, current.posture)

    def _newest(self, chain: str) -> _Played:
        return next(played for played in reversed(self._played.values()) if played.chain == chain)
