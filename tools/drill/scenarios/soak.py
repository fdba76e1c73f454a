"""Goals for so long that growing memory or drifting clocks show."""

import time
from collections import Counter

from tools.drill.harness.cell import ACCEPTED, code_of
from tools.drill.harness.lab import Lab
from tools.drill.harness.start import ARM, CellConfig
from tools.drill.harness.steal_monitor import LONG
from tools.drill.scenario import Measured, Scenario, at_least, at_most, exactly, none, reported

SECONDS, LONG_SECONDS = 600.0, 3600.0
GOAL_S = 0.25
LOOK_BACK_S = 1.0
"""A fault shows with the next goal."""
SETTLED = 0.5
"""Share of the time after which memory must not grow: by then every bounded store is full."""


def soak(lab: Lab) -> Measured:
    """Send a goal every quarter of a second, each taking over from the last; watch memory and clocks.

    An arm that braked by itself is reset and goes on; such faults are counted apart where a core was just stolen.
    """
    seconds = LONG_SECONDS if lab.long else SECONDS
    with lab.cell(CellConfig(clock="realtime")) as cell:
        cell.recover()
        began, first = time.monotonic(), cell.state()
        goals = accepted = crooked = 0
        faults: Counter[bool] = Counter()
        settled: dict[str, float] = {}
        while (passed := time.monotonic() - began) < seconds:
            if not settled and passed > SETTLED * seconds:
                settled = cell.processes.memory()
            lab.progress(f"{passed:.0f} of {seconds:.0f} s, {goals} goals")
            aim = [0.2 if goals % 2 else -0.2, *cell.home[1:]]
            code = code_of(lambda aim=aim: cell.goal(positions=aim, duration=0.6))
            accepted += code == ACCEPTED
            goals += 1
            if code == "fault":
                faults[lab.steal_monitor.most_stolen(time.monotonic() - LOOK_BACK_S) >= LONG] += 1
                cell.recover()
            state = cell.state()
            crooked += state.time != state.tick / cell.config.rate_hz
            time.sleep(max(0.0, began + goals * GOAL_S - time.monotonic()))
        last, passed = cell.state(), time.monotonic() - began
        after, status = cell.processes.memory(), cell.status()
    return {
        "goals": goals,
        "goals refused": goals - accepted - faults[True],
        "faults": faults[False],
        "faults while a core was stolen": faults[True],
        **{f"memory of the {name} grows by": after[name] - settled[name] for name in ARM},
        "times that are not tick / rate": crooked,
        "robot time behind the monotonic clock": passed - (last.time - first.time),
        "processes ended": cell.processes.ended(),
        "on-time ratio": 100 * status.cycle.on_time_ratio,
        "mode at the end": "fault" if status.fault else "no fault",
    }


SCENARIOS = (
    Scenario(
        "soak",
        "goals for ten minutes (an hour with --long), four a second",
        "realtime",
        (
            at_least("goals", 2000),
            at_most("goals refused", 24),
            none("faults"),
            reported("faults while a core was stolen"),
            *(at_most(f"memory of the {name} grows by", 2.0, "MB") for name in ARM),
            none("times that are not tick / rate"),
            at_most("robot time behind the monotonic clock", 6.0, "s"),
            reported("on-time ratio", "%"),
            exactly("mode at the end", "no fault"),
            none("processes ended"),
        ),
        soak,
        "full",
    ),
)
