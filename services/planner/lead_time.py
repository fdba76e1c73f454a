"""How far ahead of the arm a plan begins."""

from collections import defaultdict, deque

STEPPED_LEAD_TICKS = 20
UNKNOWN_PLANNING_S = 0.025
UNKNOWN_GAUSSIAN_S = 0.3
UNKNOWN_TOOL_S = 0.06
UNKNOWN_CORRECTION_S = 0.015


class LeadTime:
    """The lead of the next plan: the 90th percentile of recent planning times of its kind plus two ticks.

    The two bus hops (about 2 ms) are included though they need no lead, so few of the remaining tenth are late. A late
    plan moves nothing and is planned again with the lead of the slowest, at least twice its own time. Before anything
    was measured, and for the first ten plans, 25 ms (300 ms for "gaussian", 60 ms for "tool", 15 ms for "correction")
    count as one that was.
    `fixed` (s) overrides. In stepped time nothing is late, and the lead is 20 ticks.
    """

    def __init__(self, tick: float, fixed: float | None = None) -> None:
        self.stepped = False
        self._stepped_lead = STEPPED_LEAD_TICKS * tick
        self._fixed = fixed
        self._margin = 2 * tick
        self._took: defaultdict[str, deque[float]] = defaultdict(lambda: deque([UNKNOWN_PLANNING_S], maxlen=50))
        self._took["gaussian"] = deque([UNKNOWN_GAUSSIAN_S], maxlen=50)
        self._took["tool"] = deque([UNKNOWN_TOOL_S], maxlen=50)
        self._took["correction"] = deque([UNKNOWN_CORRECTION_S], maxlen=50)

    def seconds(self, again: bool = False, kind: str = "qp") -> float:
        """Return the lead of the next plan; `again` after one that came late."""
        if self.stepped:
            return self._stepped_lead
        if self._fixed is not None:
            return self._fixed
        took = sorted(self._took[kind])
        if again:
            return self._margin + max(took[-1], 2 * self._took[kind][-1])
        return self._margin + took[9 * len(took) // 10]

    def note(self, seconds: float, kind: str = "qp") -> None:
        """Note what a plan took from its reference to its acceptance or refusal."""
        self._took[kind].append(seconds)
