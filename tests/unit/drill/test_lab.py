"""The environment of scenarios."""

from pathlib import Path

from services.common.cli import Options
from tools.drill.harness.lab import Lab


def test_cells_log_as_text(tmp_path: Path):
    """The requested form is ignored, because scenarios read times in text logs."""
    assert Lab(Options(log="json"), tmp_path).options == Options()
