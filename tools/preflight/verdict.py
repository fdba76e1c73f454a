"""Judge a machine from a sample of tick latencies and the facts."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from services.common.realtime import Deadlines
from tools.preflight.facts import Fact

TICK_US = 1000.0
QUARTER_US = TICK_US / 4
"""Latest start of a tick that leaves the controller enough time to answer, µs."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Latencies of the ticks of a 1 ms loop, µs."""

    count: int
    median_us: float
    p99_us: float
    max_us: float
    late: int

    @property
    def missed(self) -> bool:
        """Whether a tick started after the next one was due."""
        return self.max_us >= TICK_US


def measure(seconds: float) -> Sample:
    """Run the services' 1 ms loop for `seconds` and return the latencies of its ticks."""
    late_ns = np.zeros(max(1, round(seconds * 1e6 / TICK_US)))
    deadlines = Deadlines(period_ns=round(TICK_US * 1e3))
    for index in range(len(late_ns)):
        due_ns = deadlines.next_ns + deadlines.period_ns
        deadlines.wait()
        late_ns[index] = time.monotonic_ns() - due_ns
    return summarise(late_ns / 1e3)


def summarise(late_us: np.ndarray) -> Sample:
    """Return the sample of these latencies, µs."""
    median, p99 = np.percentile(late_us, (50, 99))
    late = int(np.count_nonzero(late_us > QUARTER_US))
    return Sample(len(late_us), float(median), float(p99), float(late_us.max()), late)


def promise(sample: Sample, facts: Sequence[Fact]) -> tuple[bool, str]:
    """Return whether the machine is fit for an arm at 1 kHz, and a sentence that says why."""
    lacking = [fact.name for fact in facts if fact.needed and not fact.good]
    amiss = [fact.name for fact in facts if fact.good is False and fact.timing]
    worst = f"the worst of {sample.count} ticks came {sample.max_us:.0f} µs late"
    if sample.missed:
        return False, f"not 1 kHz: {worst}, more than a tick; simulate here, on the clock paced"
    if lacking:
        return False, f"1 kHz only while the cores are idle otherwise: {worst}, but {' and '.join(lacking)} was refused"
    if sample.late or amiss:
        reasons = [f"{sample.late} ticks later than {QUARTER_US:.0f} µs"] * bool(sample.late) + amiss
        braking = any(fact.good is False and fact.braking for fact in facts)
        what = "a stolen core, for which the arm may brake" if braking else "a late tick, which the arm tolerates"
        return True, f"1 kHz with now and then {what}: {worst}; see to {', '.join(reasons)}"
    return True, f"1 kHz under load: {worst}, and nothing is missing; the drill's soak tests it for longer"
