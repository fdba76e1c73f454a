"""How far ahead of the arm a plan begins."""

from collections import defaultdict, deque

STEPPED_LEAD_TICKS = 20
UNKNOWN_PLANNING_S = 0.025
UNKNOWN_GAUSSIAN_S = 0.3
UNKNOWN_TOOL_S = 0.06
UNKNOWN_CORRECTION_S = 0.015
SECOND_TRY, SECOND_CORRECTION = 2.0, 1.5
"""The least lead after a late plan, in parts of what that took: a correction must soon be there."""


class LeadTime:
    """The lead of the next plan: the second longest of the last 50 planning times of its kind plus a tick.

    A planning time lasts from the answer with the reference to the answer with the acceptance, in robot time, which the
    clock `paced` may let pass more slowly. Both answers take the same way, so this is the time from the one tick of the
    controller to the other. A late plan moves nothing and is planned again with the lead of the slowest, at least twice
    its own time; a late correction with that of corrections, at least 1.5 times its own time. Before anything was
    measured, and for the first ten plans, 25 ms (300 ms for "gaussian", 60 ms for "tool", 15 ms for "correction") count
    as one that was.
    `fixed` (s) overrides. In stepped time nothing is late, and the lead is 20 ticks.
    """

    def __init__(self, tick: float, fixed: float | None = None) -> None:
        self.stepped = False
        self._stepped_lead = STEPPED_LEAD_TICKS * tick
        self._fixed = fixed
        self._margin = tick
        self._took: defaultdict[str, deque[float]] = defaultdict(lambda: deque([UNKNOWN_PLANNING_S], maxlen=50))
        self._took["gaussian"] = deque([UNKNOWN_GAUSSIAN_S], maxlen=50)
        self._took["tool"] = deque([UNKNOWN_TOOL_S], maxlen=50)
        self._took["correction"] = deque([UNKNOWN_CORRECTION_S], maxlen=50)
        self._given: dict[str, float] = {}
        self._newest: dict[str, float] = {}

    def seconds(self, again: bool = False, kind: str = "qp") -> float:
        """Return the lead of the next plan; `again` after one that came late."""
        if self.stepped:
            return self._stepped_lead
        if self._fixed is not None:
            return self._fixed
        took, corrects = sorted(self._took[kind]), kind == "correction"
        lead = took[-2 if len(took) > 10 and (corrects or not again) else -1]
        if again:
            lead = max(lead, self._newest.get(kind, 0.0) * (SECOND_CORRECTION if corrects else SECOND_TRY))
        lead += self._margin
        self._given[kind] = lead
        return lead

    def note(self, seconds: float, kind: str = "qp", late: bool = False) -> None:
        """Note what a plan took from its reference to its acceptance or refusal, s of robot time.

        What was `late` took at least the lead that it had: where the robot's time was foreseen, it was later.
        """
        self._newest[kind] = seconds
        self._took[kind].append(max(seconds, self._given.get(kind, 0.0)) if late else seconds)
