"""Lead time of plans: from the present to the start of the motion."""

from collections import deque

STEPPED_LEAD_TICKS = 20
UNKNOWN_S = 0.025
UNKNOWN_OF_KIND_S = {"gaussian": 0.3, "tool": 0.06, "correction": 0.015}
"""Planning times before any is measured, s."""
REMEMBERED = 50
SECOND_TRY, SECOND_CORRECTION = 2.0, 1.5
"""Smallest lead after a late plan, in units of its planning time; smaller for corrections, which are urgent."""
PATIENT_S = 0.5
"""Smallest lead after a late plan of a goal that can wait, s: the machine is busy, and there is no third try."""


class LeadTime:
    """The lead of the next plan: the second longest of the last 50 planning times of its kind plus a tick.

    A planning time is measured from the reply with the reference to the reply with the acceptance, in robot time, which
    may pass more slowly with the clock `paced`. Both replies have the same delay, so this is the time between the two
    ticks of the controller. A late plan moves nothing and is repeated with the lead of the slowest kind, at least twice
    its planning time and, if the goal can wait, at least 0.5 s; a late correction with the lead of corrections, at
    least 1.5 times its planning time. For the first ten plans, an initial value counts as a measurement.
    `fixed` (s) overrides. With the stepped clock no plan is late, and the lead is 20 ticks.
    """

    def __init__(self, tick: float, fixed: float | None = None) -> None:
        self.stepped = False
        self._stepped_lead = STEPPED_LEAD_TICKS * tick
        self._fixed = fixed
        self._margin = tick
        self._took: dict[str, deque[float]] = {}
        self._given: dict[str, float] = {}
        self._newest: dict[str, float] = {}
        self._was_late = False

    def seconds(self, again: bool = False, kind: str = "qp", can_wait: bool = False) -> float:
        """Return the lead of the next plan, s.

        again: after a plan that was late or superseded. can_wait: the goal prescribes no time of its hit.
        """
        if self.stepped:
            return self._stepped_lead
        if self._fixed is not None:
            return self._fixed
        took, corrects = sorted(self._planning_times(kind)), kind == "correction"
        lead = took[-2 if len(took) > 10 and (corrects or not again) else -1]
        if again:
            lead = max(lead, self._newest.get(kind, 0.0) * (SECOND_CORRECTION if corrects else SECOND_TRY))
            if self._was_late and can_wait:
                lead = max(lead, PATIENT_S)
        lead += self._margin
        self._given[kind] = lead
        return lead

    def note(self, seconds: float, kind: str = "qp", late: bool = False) -> None:
        """Add a planning time, from the reference to the acceptance or refusal, s of robot time.

        A `late` plan took at least its lead, even if the predicted robot time says less.
        """
        self._newest[kind], self._was_late = seconds, late
        self._planning_times(kind).append(max(seconds, self._given.get(kind, 0.0)) if late else seconds)

    def _planning_times(self, kind: str) -> deque[float]:
        return self._took.setdefault(kind, deque([UNKNOWN_OF_KIND_S.get(kind, UNKNOWN_S)], maxlen=REMEMBERED))
