"""Fixtures for tests of the recorder: one that writes into a file, under a strict Rerun."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import rerun as rr

from tests.unit.recorder.recorder_to_file import RecorderToFile


@pytest.fixture(autouse=True)
def strict() -> Iterator[None]:
    """Misuse of Rerun raises instead of being logged."""
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture
def recorder(tmp_path: Path) -> RecorderToFile:
    return RecorderToFile(tmp_path / "trace.rrd")
