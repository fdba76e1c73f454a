"""A screenshot that the viewer cannot make is refused with the cause."""

from pathlib import Path
from uuid import UUID

import pytest
import rerun_cli
from rerun.experimental import ViewerClient

from tools.screenshot import TRIES, save, take_screenshot

VIEWER = """#!/bin/sh
[ "$1" = analytics ] && exit 0
echo "{output}" >&2
exit 102
"""


@pytest.mark.parametrize(
    ("output", "sentence"),
    [
        ("panicked at 'Failed to get render context'", "has no graphics driver; install one, on Debian: apt install"),
        ("no such file", "the viewer ended before it showed the trace; its last output: no such file"),
    ],
)
def test_a_viewer_that_ends_is_reported_with_its_cause(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, output: str, sentence: str
) -> None:
    viewer = tmp_path / "rerun"
    viewer.write_text(VIEWER.format(output=output))
    viewer.chmod(0o755)
    monkeypatch.setattr(rerun_cli, "__file__", str(tmp_path / "__init__.py"))
    with pytest.raises(RuntimeError, match=sentence):
        take_screenshot(tmp_path / "a.rrd", tmp_path / "a.png")


def test_a_viewer_that_draws_too_slowly_is_asked_again(tmp_path: Path) -> None:
    class Slow(ViewerClient):
        def __init__(self, failures: int) -> None:
            self.failures = failures

        def save_screenshot(self, file_path: str, view_id: str | UUID | None = None) -> None:
            self.failures -= 1
            if self.failures >= 0:
                raise TimeoutError("Deadline expired before operation could complete")
            Path(file_path).write_text("an image")

    save(Slow(TRIES - 1), tmp_path / "a.png")
    assert (tmp_path / "a.png").exists()
    with pytest.raises(TimeoutError):
        save(Slow(TRIES), tmp_path / "b.png")
