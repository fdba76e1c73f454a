"""Two arms return each other's ball through the running services, four times slower than the wall clock."""

from pathlib import Path

import pytest
from rich.console import Console

from tools.rally.flags import Flags
from tools.rally.partners import rally_with, summary
from tools.rally.rallies import Rally


@pytest.mark.realtime
def test_two_arms_return_each_others_balls(tmp_path: Path):
    played: list[Rally] = []
    flags = Flags(partners=2, rallies=1, strokes=3, slow=4.0, revise_hz=20.0, record=tmp_path / "partners.rrd")
    rally_with(flags, Console(quiet=True), played)
    (rally,) = played
    assert (rally.server, rally.strokes, rally.over) == ("near", 3, "all strokes played")
    assert summary(played)["violations"] == 0
    assert flags.record.stat().st_size > 1e5
