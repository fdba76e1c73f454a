"""A rally that ends early reports what was played."""

import json

import pytest

from protocol.errors import NoAnswer
from robot.striking.launcher import Launch
from tools.rally import partners, thrown
from tools.rally.__main__ import main
from tools.rally.flags import Flags
from tools.rally.play import Stroke
from tools.rally.rallies import Rally

ENDS = pytest.mark.parametrize(
    ("end", "status"),
    [(NoAnswer("sim", "volley/near/sim/ball", "it is silent"), 1), (KeyboardInterrupt(), 130)],
    ids=["silence", "interruption"],
)


@ENDS
def test_rallies_of_partners_are_reported_after_an_early_end(monkeypatch, capsys, end, status):
    def played_then_ended(flags: Flags, console: object, played: list[Rally]) -> None:
        played.append(Rally("near", strokes=7))
        raise end

    monkeypatch.setattr(partners, "rally_with", played_then_ended)
    monkeypatch.setattr("sys.argv", ["volley rally", "--partners", "2", "--json"])
    assert main() == status
    assert json.loads(capsys.readouterr().out)["strokes"] == [7]


@ENDS
def test_thrown_balls_are_reported_after_an_early_end(monkeypatch, capsys, end, status):
    def played_then_ended(flags: Flags, console: object, strokes: list[Stroke]) -> None:
        strokes.append(Stroke(Launch((4.0, 0.0, 1.0), (-4.0, 0.0, 3.0), (0.0, 0.0, 1.0), 1.0, 1)))
        raise end

    monkeypatch.setattr(thrown, "play", played_then_ended)
    monkeypatch.setattr("sys.argv", ["volley rally", "--json"])
    assert main() == status
    assert json.loads(capsys.readouterr().out)["balls"] == 1
