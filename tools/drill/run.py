"""Carry out one scenario, again where CPU steal disturbed it."""

import time
from dataclasses import replace

from protocol.errors import Refusal
from services.common.steal_time import STEP_S
from tools.drill.harness.lab import Lab
from tools.drill.harness.steal_monitor import LONG
from tools.drill.harness.waiting import ScenarioError
from tools.drill.report import shortfall
from tools.drill.scenario import Measured, Scenario, ScenarioOutcome, judge

BRAKED = "fault", "late"
"""Codes of goals that are refused because the arm has braked, or because they came late."""

TRIES = 3
"""A machine with steal in each of them is not fit for the drill."""


def carry_out(scenario: Scenario, lab: Lab) -> ScenarioOutcome:
    """Cause the fault and measure the reaction; an error ends the scenario and is in the outcome.

    The scenario is carried out again if a core was stolen meanwhile for so long that an arm may have to brake, and if
    nothing fell short but timed bounds, or it ended because the arm had not done what was waited for. The outcome has
    what fell short in earlier attempts. Nothing else is repeated.
    """
    before: list[str] = []
    while True:
        began = lab.steal_monitor.sample()
        outcome, excusable = _carry_out_once(scenario, lab)
        if not excusable or len(before) + 1 == TRIES or (steps := lab.steal_monitor.most_stolen(began)) < LONG:
            return replace(outcome, before=tuple(before))
        before.append(f"a core was stolen for {1e3 * STEP_S * steps:.0f} ms; {shortfall(outcome)}")
        lab.progress(f"once more: {before[-1]}")


def _carry_out_once(scenario: Scenario, lab: Lab) -> tuple[ScenarioOutcome, bool]:
    """Return the outcome, and whether CPU steal may explain it: never where no bound is timed."""
    began = time.monotonic()
    measured: Measured = {}
    caught = None
    try:
        measured = scenario.run(lab)
    except Exception as error:  # whatever it is, the other scenarios go on and the table has it
        caught = error
        lab.end_shared()
    words = f"{type(caught).__name__}: {caught}" if caught else ""
    outcome = judge(scenario, measured, time.monotonic() - began, words)
    if outcome.held or scenario.clock == "stepped" or not any(bound.timed for bound in scenario.bounds):
        return outcome, False
    if caught:
        return outcome, isinstance(caught, ScenarioError) or (isinstance(caught, Refusal) and caught.code in BRAKED)
    return outcome, all(reaction.held or reaction.bound.timed for reaction in outcome.reactions)
