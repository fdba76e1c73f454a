"""The drill's exact scenarios, and the short ones in real time."""

import warnings
from collections.abc import Iterator

import pytest

from services.common.cli import Options
from tests.cores import LOOP_CORE
from tools.drill.harness.lab import Lab
from tools.drill.report import failures
from tools.drill.run import run_scenario
from tools.drill.scenario import Scenario
from tools.drill.table import SCENARIOS


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """Yield one lab for all scenarios."""
    with Lab(Options(loop_core=LOOP_CORE), tmp_path_factory.mktemp("drill")) as lab:
        yield lab


def of_kind(kind: str) -> list[Scenario]:
    """Return the scenarios of a kind; the fuzzer has a module of its own."""
    return [scenario for name, scenario in SCENARIOS.items() if scenario.kind == kind and name != "fuzz"]


@pytest.mark.parametrize("scenario", of_kind("exact"), ids=lambda scenario: scenario.name)
def test_exact(lab: Lab, scenario: Scenario):
    """Every bound of the scenario holds."""
    outcome = run_scenario(scenario, lab)
    assert outcome.held, failures(outcome)


@pytest.mark.realtime
@pytest.mark.filterwarnings("default::pytest.PytestWarning")
@pytest.mark.parametrize("scenario", of_kind("short"), ids=lambda scenario: scenario.name)
def test_in_real_time(lab: Lab, scenario: Scenario):
    """Every bound of the scenario holds.

    If a core was stolen and the scenario was repeated, a warning shows the earlier attempts.
    """
    outcome = run_scenario(scenario, lab)
    for attempt in outcome.earlier_attempts:
        warnings.warn(pytest.PytestWarning(f"repeated: {attempt}"), stacklevel=1)
    assert outcome.held, failures(outcome)
