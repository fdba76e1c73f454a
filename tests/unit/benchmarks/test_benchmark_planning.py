"""The benchmark of planning runs on the present code and prints its table."""

from pathlib import Path

import pytest

from benchmarks import planning


def test_it_measures_and_prints_everything(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    saved = {}

    def save(name: str, found: dict) -> Path:
        saved[name] = found
        return Path(name)

    monkeypatch.setattr(planning, "save", save)
    monkeypatch.setattr(planning, "freeze_garbage", lambda: None)
    planning.main(goals=1, beside=1, corrections=1)
    assert saved["planning"]["one joint"]["Volley, cold"]["solved"] == 1
    assert saved["planning"]["one joint"]["Volley, cold"]["violation"] == 0
    assert "Six joints in one plan" in capsys.readouterr().out
