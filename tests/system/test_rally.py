"""A short rally through the running services, three times slower than the wall clock."""

from pathlib import Path

import pytest
from harness import SERVICES, running
from rich.console import Console

from examples import rally
from tools.rally.flags import Flags
from tools.rally.play import Stroke
from tools.rally.report import summary
from tools.rally.thrown import play


@pytest.mark.realtime
def test_a_ball_is_returned_and_every_correction_is_said(tmp_path: Path):
    strokes: list[Stroke] = []
    play(Flags(balls=1, slow=3.0, seed=0, record=tmp_path / "rally.rrd"), Console(quiet=True), strokes)
    (stroke,) = strokes
    phases = [strike.phase for strike in stroke.strikes]
    assert phases[:2] == ["seen", "planned"]
    assert phases[-2:] == ["hit", "landed"]
    assert stroke.corrections >= 1
    assert stroke.score.returned
    found = summary(strokes)
    assert (found["balls"], found["hit"], found["returned"], found["violations"]) == (1, 1, 1, 0)
    said = stroke.strikes[-1].landing
    assert said is not None
    assert stroke.score.distance is not None
    assert abs(said.distance - stroke.score.distance) < 0.15, "the striker's landing point is far from the true one"


@pytest.mark.realtime
def test_the_example_says_what_became_of_its_ball(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    with running(tmp_path, names=(*SERVICES, "striker"), clock="paced", learned=tmp_path / "learned.json") as stack:
        rally.main(stack.endpoint)
    lines = capsys.readouterr().out.splitlines()
    assert "ball 1 seen" in lines[0]
    assert any("ball 1 landed" in line or "ball 1 missed" in line for line in lines)
