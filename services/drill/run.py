"""Carries scenarios out, one after another."""

import time
from dataclasses import replace

from services.drill.lab import Lab
from services.drill.scenario import Measured, Outcome, Scenario, judge
from services.drill.witness import LONG_S

TRIES = 3


def carry_out(scenario: Scenario, lab: Lab) -> Outcome:
    """Cause the fault and measure the reaction; what breaks the scenario off is told in the outcome.

    In real time, where a bound fell short while the host of this machine withheld a core for as long as makes any arm
    brake, the scenario is carried out again, which the outcome tells: what was measured is the host's doing. Nothing
    else is tried again.
    """
    withheld: list[float] = []
    while True:
        began = time.monotonic()
        outcome = replace(_carry_out_once(scenario, lab), withheld=tuple(withheld))
        away = lab.witness.withheld_s(began)
        if outcome.held or scenario.clock == "stepped" or away < LONG_S or len(withheld) + 1 == TRIES:
            return outcome
        withheld.append(away)
        lab.say(f"once more, since the host withheld a core for {1e3 * away:.0f} ms")


def _carry_out_once(scenario: Scenario, lab: Lab) -> Outcome:
    began, broken = time.monotonic(), ""
    measured: Measured = {}
    try:
        measured = scenario.run(lab)
    except Exception as error:  # whatever it is, the other scenarios go on and the table tells
        broken = f"{type(error).__name__}: {error}"
        lab.end_shared()
    return judge(scenario, measured, time.monotonic() - began, broken)
