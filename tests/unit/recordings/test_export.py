"""Export of played motions to every format."""

from pathlib import Path

import numpy as np
import pytest

from tests.unit.recordings import writers as others
from tools.recordings.learning import load
from tools.recordings.recording import Recording, Unreadable
from tools.recordings.writers import WRITERS, write


def played(times: np.ndarray) -> Recording:
    """Return a motion as read from a trace, with numbers that use the whole mantissa."""
    values = np.stack([np.interp(times, others.TIMES, column) for column in others.movement().T], axis=1) + 1 / 3
    return Recording(times, others.JOINTS, values, "rad", Path("trace.rrd"), "forehand-1", True)


@pytest.mark.parametrize("ending", WRITERS)
def test_an_exported_motion_is_read_back_unchanged(tmp_path: Path, ending: str):
    recording = played(np.arange(1001) / 1000)
    output = tmp_path / f"swing{ending}"
    write(recording, output)
    back = load(output, others.JOINTS)
    assert back.times == pytest.approx(recording.times, abs=1e-6)
    assert np.abs(back.values - recording.values).max() < 1e-6
    with pytest.raises(Unreadable, match="exists"):
        write(recording, output)


def test_missing_ticks_are_interpolated_for_lerobot(tmp_path: Path):
    """LeRobot's frames are evenly spaced and cannot have gaps."""
    whole = played(np.arange(1001) / 1000)
    kept = np.delete(np.arange(1001), [300, 301])
    holed = Recording(
        whole.times[kept], whole.columns, whole.values[kept], "rad", whole.source, whole.episode, whole.stamped
    )
    write(holed, tmp_path / "set")
    back = load(tmp_path / "set", others.JOINTS)
    assert len(back.times) == 1001
    assert np.abs(back.values - whole.values).max() < 1e-4


@pytest.mark.parametrize(
    ("output", "sentence"),
    [("swing.xlsx", "unknown ending; it must be .csv"), ("absent/swing.csv", "cannot be written")],
)
def test_an_unknown_ending_or_absent_directory_is_refused(tmp_path: Path, output: str, sentence: str):
    with pytest.raises(Unreadable, match=sentence):
        write(played(np.arange(11) / 10), tmp_path / output)
