"""The environment in which scenarios are carried out."""

from pathlib import Path

from services.common.cli import Options
from tools.drill.harness.lab import Lab


def test_cells_log_in_text_form(tmp_path: Path):
    """The requested form is ignored, because scenarios read times from text logs."""
    assert Lab(Options(log="json"), tmp_path).options == Options()
