"""The command that runs the drill."""

import json
from pathlib import Path

import pytest

from tools.drill import __main__ as command
from tools.drill.harness.lab import Lab
from tools.drill.scenario import Scenario, ScenarioOutcome, evaluate


def test_an_interrupted_drill_keeps_what_was_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    """The first scenario is printed and saved; the second one is interrupted."""

    def run_scenario(scenario: Scenario, _: Lab) -> ScenarioOutcome:
        if scenario.name == "push":
            raise KeyboardInterrupt
        return evaluate(scenario, {bound.reaction: bound.value for bound in scenario.bounds}, 1.0)

    file = tmp_path / "drill.json"
    monkeypatch.setattr(command, "run_scenario", run_scenario)
    monkeypatch.setattr("sys.argv", ["drill", "--only", "cancel", "--only", "push", "--json", str(file)])
    assert command.main() == 130
    assert "interrupted after 1 of 2 scenarios" in capsys.readouterr().out
    assert list(json.loads(file.read_text())["rows"]) == ["cancel"]
