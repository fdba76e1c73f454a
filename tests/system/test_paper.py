"""Fig. 5 on the running services gives the committed numbers."""

import math
from pathlib import Path

import pytest

pytest.importorskip("matplotlib", reason="the extra `paper` is not installed")

from experiments import live, table

RELATIVE = 0.05
"""Relative tolerance for the rounding of another machine, as for the other experiments.

On one machine all runs are equal to every digit, because the clock is stepped and the noise is seeded."""

ABSOLUTE = 1e-6


def test_the_arm_gives_the_committed_numbers(tmp_path: Path):
    """Each number agrees within 5 %, and a trace is written."""
    trace = tmp_path / "fig5.rrd"
    committed = {row.name: row for row in table.read_results() if row.name.startswith("live.")}
    rows = live.run(trace).rows
    assert [row.name for row in rows] == list(committed)
    for row in rows:
        known = committed[row.name]
        assert (row.unit, row.paper_claim) == (known.unit, known.paper_claim)
        assert math.isclose(row.value, known.value, rel_tol=RELATIVE, abs_tol=ABSOLUTE), row.name
    assert trace.stat().st_size > 0
