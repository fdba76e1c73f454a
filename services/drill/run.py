"""Carries scenarios out, one after another."""

import time

from services.drill.lab import Lab
from services.drill.scenario import Measured, Outcome, Scenario, judge


def carry_out(scenario: Scenario, lab: Lab) -> Outcome:
    """Cause the fault and measure the reaction; what breaks the scenario off is told in the outcome."""
    began, broken = time.monotonic(), ""
    measured: Measured = {}
    try:
        measured = scenario.run(lab)
    except Exception as error:  # whatever it is, the other scenarios go on and the table tells
        broken = f"{type(error).__name__}: {error}"
        lab.end_shared()
    return judge(scenario, measured, time.monotonic() - began, broken)
