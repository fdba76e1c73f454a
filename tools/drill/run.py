"""Carries scenarios out, one after another."""

import time
from dataclasses import replace

from protocol.errors import Refusal
from services.common.steal_time import STEP_S
from tools.drill.harness.cell import Broken
from tools.drill.harness.lab import Lab
from tools.drill.harness.steal_monitor import LONG
from tools.drill.report import shortfall
from tools.drill.scenario import Measured, Outcome, Scenario, judge

BRAKED = "fault", "late"
"""Codes with which goals are refused that came to an arm that has braked, or too late."""

TRIES = 3
"""A host that withholds cores in each of them is no machine to drill on."""


def carry_out(scenario: Scenario, lab: Lab) -> Outcome:
    """Cause the fault and measure the reaction; what breaks the scenario off is told in the outcome.

    Where nothing fell short but what a core's absence may move, and the host of this machine did withhold one meanwhile
    for so long that an arm may have to brake, the scenario is carried out again: also where it broke off, since the arm
    did not do what was waited for. The outcome tells of the tries before. Nothing else is tried again.
    """
    before: list[str] = []
    while True:
        began = lab.witness.look()
        outcome, excusable = _carry_out_once(scenario, lab)
        if not excusable or len(before) + 1 == TRIES or (steps := lab.witness.withheld(began)) < LONG:
            return replace(outcome, before=tuple(before))
        before.append(f"the host withheld a core for {1e3 * STEP_S * steps:.0f} ms; {shortfall(outcome)}")
        lab.say(f"once more: {before[-1]}")


def _carry_out_once(scenario: Scenario, lab: Lab) -> tuple[Outcome, bool]:
    """The outcome, and whether it may be the doing of a host that withholds cores: never where no bound is timed."""
    began = time.monotonic()
    measured: Measured = {}
    error = None
    try:
        measured = scenario.run(lab)
    except Exception as caught:  # whatever it is, the other scenarios go on and the table tells
        error = caught
        lab.end_shared()
    broken = f"{type(error).__name__}: {error}" if error else ""
    outcome = judge(scenario, measured, time.monotonic() - began, broken)
    if outcome.held or scenario.clock == "stepped" or not any(bound.timed for bound in scenario.bounds):
        return outcome, False
    if error:
        return outcome, isinstance(error, Broken) or (isinstance(error, Refusal) and error.code in BRAKED)
    return outcome, all(reaction.held or reaction.bound.timed for reaction in outcome.reactions)
