"""The table of all scenarios, by family."""

from collections.abc import Iterable

from tools.drill.scenario import Scenario
from tools.drill.scenarios import (
    clients,
    clocks,
    fuzz,
    goals,
    load,
    messages,
    misuse,
    planners,
    preemption,
    pushes,
    recorders,
    restarts,
    silence,
    soak,
    strikers,
)

FAMILIES: dict[str, tuple[Scenario, ...]] = {
    "silence": silence.SCENARIOS,
    "restarts": restarts.SCENARIOS,
    "planner": planners.SCENARIOS,
    "recorder": recorders.SCENARIOS,
    "striker": strikers.SCENARIOS,
    "clients": clients.SCENARIOS,
    "clocks": clocks.SCENARIOS,
    "messages": messages.SCENARIOS,
    "goals": goals.SCENARIOS,
    "preemption": preemption.SCENARIOS,
    "misuse": misuse.SCENARIOS,
    "pushes": pushes.SCENARIOS,
    "load": load.SCENARIOS,
    "fuzzing": fuzz.SCENARIOS,
    "soak": soak.SCENARIOS,
}
SCENARIOS: dict[str, Scenario] = {scenario.name: scenario for family in FAMILIES.values() for scenario in family}


def select(names: Iterable[str]) -> list[Scenario]:
    """Return the scenarios with these names, or all scenarios if no names are given.

    Raises:
        KeyError: a name belongs to no scenario; the sentence lists all names.
    """
    wanted = list(names)
    unknown = [name for name in wanted if name not in SCENARIOS]
    if unknown:
        raise KeyError(f"there is no scenario {' or '.join(unknown)}; the scenarios are {', '.join(SCENARIOS)}")
    return [SCENARIOS[name] for name in wanted or SCENARIOS]
