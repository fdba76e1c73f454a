"""Fig. 5 on the running services brings the numbers that the table holds."""

import math
from pathlib import Path

import pytest

pytest.importorskip("matplotlib", reason="the extra `paper` is not installed")

from experiments import live, table

RELATIVE = 0.05
"""As for the other experiments: of a value, what another machine's rounding may change. The clock is stepped and the
noise seeded, so that on one machine runs are alike to every digit."""

ABSOLUTE = 1e-6


def test_the_arm_brings_the_committed_numbers(tmp_path: Path):
    """Each to 5 %; and it leaves a trace."""
    trace = tmp_path / "fig5.rrd"
    committed = {row.name: row for row in table.read_results() if row.name.startswith("live.")}
    rows = live.run(trace).rows
    assert [row.name for row in rows] == list(committed)
    for row in rows:
        known = committed[row.name]
        assert (row.unit, row.paper_claim) == (known.unit, known.paper_claim)
        assert math.isclose(row.value, known.value, rel_tol=RELATIVE, abs_tol=ABSOLUTE), row.name
    assert trace.stat().st_size > 0
