"""Where scenarios are carried out."""

from pathlib import Path

from services.common.cli import Options
from tools.drill.harness.lab import Lab


def test_cells_log_as_text(tmp_path: Path):
    """Whatever was asked for: scenarios read there when something was said."""
    assert Lab(Options(log="json"), tmp_path).options == Options()
