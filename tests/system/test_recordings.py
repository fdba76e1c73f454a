"""From another program's file to a motion, and out of its trace again, by the shell's commands alone."""

from pathlib import Path

import numpy as np
import pytest

from robot.description import load_robot
from services.common.cell import running_cell
from tests.unit.recordings import writers
from tools.recordings import readers
from tools.recordings.learning import load
from tools.shell.__main__ import main

JOINTS = load_robot().joint_names


def test_from_a_file_to_a_motion_and_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Eleven demonstrations without names or times: one is chosen, learned, played, exported and learned again."""
    source, trace = tmp_path / "low_dim.hdf5", tmp_path / "trace.rrd"
    writers.write_robomimic(source)
    with running_cell(flags={"record": trace, "no_live": True}, quiet=True) as cell:

        def volley(*words: str) -> int:
            return main([*words, "--connect", cell.endpoint])

        assert volley("learn", str(source)) == 2
        assert "choose one with --episode: demo_0, demo_1" in capsys.readouterr().err
        assert volley("learn", str(source), "--episode", "demo_0", "--name", "reach") == 0
        start = [f"{value:.9f}" for value in writers.movement()[0]]
        assert volley("reset-sim", "--positions", *start) == 0
        assert volley("goal", "reach", "--wait", "--goal-id", "played") == 0
        assert "succeeded" in capsys.readouterr().out
    _check_what_was_played(trace)
    for output in (tmp_path / "out.csv", tmp_path / "out.npz", tmp_path / "out.mcap", tmp_path / "out"):
        assert main(["export", "last", "--trace", str(trace), "-o", str(output)]) == 0
        played, back = readers.read(trace, "played"), load(output, JOINTS)
        assert np.abs(back.values - played.values).max() < 1e-6
        assert back.times == pytest.approx(played.times, abs=1e-6)


def _check_what_was_played(trace: Path) -> None:
    """The measured motion is the demonstration's, within 1 % of each joint's range or 5 mrad."""
    played = readers.read(trace, "played")
    shown = np.stack([np.interp(played.times, writers.TIMES, column) for column in writers.movement().T], axis=1)
    bound = np.maximum(0.01 * np.ptp(shown, axis=0), 0.005)
    assert played.columns == JOINTS
    assert np.all(np.abs(played.values - shown).max(axis=0) < bound)
