"""A screenshot that the viewer cannot make is refused with the cause."""

from pathlib import Path

import pytest
import rerun_cli

from tools.screenshot import take_screenshot

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
