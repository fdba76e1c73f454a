"""Export of played motions to every format."""

from pathlib import Path

import numpy as np
import pytest

from tests.unit.recordings import writers as others
from tools.recordings import writers
from tools.recordings.learning import load
from tools.recordings.recording import Recording, Unreadable
from tools.recordings.writers import WRITERS, write
from tools.shell.__main__ import main


def played(times: np.ndarray) -> Recording:
    """Return a motion with numbers that use the whole mantissa, stored by columns, as after columns were chosen."""
    values = np.stack([np.interp(times, others.TIMES, column) for column in others.movement().T], axis=1) + 1 / 3
    return Recording(times, others.JOINTS, np.asfortranarray(values), "rad", Path("trace.rrd"), "forehand-1", True)


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


def test_a_missing_library_is_named_with_the_file_that_was_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)
    with pytest.raises(Unreadable, match=r"^swing\.mcap: MCAP is written by rosbags: pip install"):
        write(played(np.arange(20) / 100), tmp_path / "swing.mcap")
    assert not list(tmp_path.iterdir())


def test_an_interrupted_export_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def interrupted(recording: Recording, output: Path) -> None:
        output.write_text("half")
        raise KeyboardInterrupt

    monkeypatch.setitem(writers.WRITERS, ".csv", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write(played(np.arange(11) / 10), tmp_path / "swing.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "writer", "said"),
    [
        ("log.rrd", others.write_rrd, "log.rrd is not a trace of Volley's recorder; learn it with volley learn"),
        ("driver.csv", others.write_csv, "driver.csv is not an .rrd file; name a trace of Volley's recorder"),
    ],
)
def test_what_was_not_played_is_not_exported(tmp_path: Path, capsys, name: str, writer, said: str):
    """Its columns and its unit are not the arm's."""
    writer(tmp_path / name)
    assert main(["export", "last", "--trace", str(tmp_path / name), "-o", str(tmp_path / "out.npz")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out.npz").exists()
