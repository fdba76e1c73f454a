"""Goals for long enough to reveal memory leaks and clock drift."""

import time
from collections import Counter

from tools.drill.harness.cell import ACCEPTED, refusal_code
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.steal_monitor import BRAKING_STEPS
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, reported

SECONDS, LONG_SECONDS = 600.0, 3600.0
GOAL_S = 0.25
STEAL_WINDOW_S = 1.0
"""A fault is attributed to CPU steal within this time before its detection by the next goal."""
SETTLED = 0.5
"""Fraction of the duration after which memory must not grow, because every bounded buffer is full."""


def soak(lab: Lab) -> Measured:
    """Send a goal every 0.25 s, each of which replaces the last; measure memory and clocks.

    After a fault the controller is reset and the test continues. Faults after CPU steal are counted separately.
    """
    seconds = LONG_SECONDS if lab.long else SECONDS
    with lab.cell(CellConfig(clock="realtime")) as cell:
        began, first = time.monotonic(), cell.state()
        goals = accepted = wrong_times = 0
        faults: Counter[bool] = Counter()
        settled: dict[str, float] = {}
        while (passed := time.monotonic() - began) < seconds:
            if not settled and passed > SETTLED * seconds:
                settled = cell.processes.memory()
            lab.progress(f"{passed:.0f} of {seconds:.0f} s, {goals} goals")
            aim = [0.2 if goals % 2 else -0.2, *cell.home[1:]]
            code = refusal_code(lambda aim=aim: cell.goal(positions=aim, duration=0.6))
            accepted += code == ACCEPTED
            goals += 1
            if code == "fault":
                faults[lab.steal_monitor.peak_steal(time.monotonic() - STEAL_WINDOW_S) >= BRAKING_STEPS] += 1
                cell.recover()
            state = cell.state()
            wrong_times += state.time != state.tick / cell.config.rate_hz
            time.sleep(max(0.0, began + goals * GOAL_S - time.monotonic()))
        last, passed = cell.state(), time.monotonic() - began
        after, status = cell.processes.memory(), cell.status()
    return {
        "goals sent": goals,
        "goals refused": goals - accepted - faults[True],
        "faults": faults[False],
        "faults during CPU steal": faults[True],
        **{f"memory growth of the {name}": after[name] - settled[name] for name in ARM},
        "states whose time is not tick / rate": wrong_times,
        "lag of robot time": passed - (last.time - first.time),
        "processes that exited": cell.processes.ended(),
        "on-time ratio": 100 * status.cycle.on_time_ratio,
        "fault at the end": status.fault or "none",
    }


SCENARIOS = (
    Scenario(
        "soak",
        "four goals a second for ten minutes (an hour with --long)",
        (
            at_least("goals sent", 2000),
            at_most("goals refused", 24),
            none("faults"),
            reported("faults during CPU steal"),
            *(at_most(f"memory growth of the {name}", 2.0, "MB") for name in ARM),
            none("states whose time is not tick / rate"),
            at_most("lag of robot time", 6.0, "s"),
            reported("on-time ratio", "%"),
            exactly("fault at the end", "none"),
            none("processes that exited"),
        ),
        soak,
        "realtime",
        "full",
    ),
)
