"""Run one scenario, and repeat it if CPU steal may have disturbed it."""

import time
from dataclasses import replace

from protocol.errors import Refusal
from services.common.steal_time import STEP_S
from tools.drill.harness.lab import Lab
from tools.drill.harness.steal_monitor import BRAKING_STEPS
from tools.drill.harness.waiting import ScenarioError
from tools.drill.report import failures
from tools.drill.scenario import Measured, Scenario, ScenarioOutcome, evaluate

BRAKE_CODES = "fault", "late"
"""Codes of goals that are refused because the arm has braked or their plan was late, as after CPU steal."""

MAX_ATTEMPTS = 3
"""Largest number of attempts; a machine with steal in each of them is unsuitable for the drill."""


def run_scenario(scenario: Scenario, lab: Lab) -> ScenarioOutcome:
    """Cause the fault and measure the reaction; an error ends the scenario and becomes part of the outcome.

    A scenario is repeated if one core had enough steal time to make an arm brake, and either only timed bounds failed
    or the scenario ended because a wait timed out or a goal was refused as `fault` or `late`. The outcome lists the
    failures of earlier attempts.
    """
    earlier: list[str] = []
    while True:
        began = lab.steal_monitor.sample()
        outcome, may_repeat = _run_once(scenario, lab)
        steps = lab.steal_monitor.peak_steal(began)
        if not may_repeat or steps < BRAKING_STEPS or len(earlier) + 1 == MAX_ATTEMPTS:
            return replace(outcome, earlier_attempts=tuple(earlier))
        earlier.append(f"{1e3 * STEP_S * steps:.0f} ms of CPU steal on one core; {failures(outcome)}")
        lab.progress(f"repeated: {earlier[-1]}")


def _run_once(scenario: Scenario, lab: Lab) -> tuple[ScenarioOutcome, bool]:
    """Return the outcome, and whether CPU steal may explain its failure; without a timed bound it never does."""
    began = time.monotonic()
    measured: Measured = {}
    caught = None
    try:
        measured = scenario.run(lab)
    except Exception as error:  # the table reports it, and the other scenarios still run
        caught = error
        lab.end_shared()
    sentence = f"{type(caught).__name__}: {caught}" if caught else ""
    outcome = evaluate(scenario, measured, time.monotonic() - began, sentence)
    if outcome.held or scenario.clock == "stepped" or not any(bound.timed for bound in scenario.bounds):
        return outcome, False
    if caught:
        return outcome, isinstance(caught, ScenarioError) or (
            isinstance(caught, Refusal) and caught.code in BRAKE_CODES
        )
    return outcome, all(reaction.held or reaction.bound.timed for reaction in outcome.reactions)
