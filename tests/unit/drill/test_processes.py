"""Times read from the logs of a cell's processes."""

from datetime import datetime
from pathlib import Path

from services.common.supervisor import Supervisor
from tools.drill.harness.processes import Processes

LOG = """\
2026-11-28 22:26:46,060 controller INFO: the arm fell silent
a line without a time: the arm fell silent
2026-11-28 22:26:47,250 controller WARNING: the arm fell silent
"""


def at(second: str) -> float:
    """Return a time of the log, Unix s."""
    return datetime.fromisoformat(f"2026-11-28 22:26:{second}").timestamp()


def test_the_first_log_line_with_given_words_after_a_time_is_found(tmp_path: Path):
    """Times have a resolution of 1 ms; lines without a time are skipped."""
    (tmp_path / "controller.log").write_text(LOG)
    processes = Processes(Supervisor({}), tmp_path)
    assert processes.logged_at("controller", "fell silent", at("46.000")) == at("46.060")
    assert processes.logged_at("controller", "fell silent", at("46.0605")) == at("46.060")
    assert processes.logged_at("controller", "fell silent", at("46.100")) == at("47.250")
    assert processes.logged_at("controller", "fell silent", at("48.000")) is None
    assert processes.logged_at("controller", "is here", at("46.000")) is None
