"""From another program's file to a motion, and out of its trace again, by the shell's commands alone."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from benchmarks.learning import DEMOS
from protocol import messages as m
from robot.description import load_robot
from services.common.cell import running_cell
from services.common.cli import Options
from tests.arms import PANDA
from tests.unit.recordings import writers
from tests.waiting import eventually
from tools.recordings import readers
from tools.recordings.learning import load
from tools.recordings.readers import rrd
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
        _check_what_is_cut_out(volley, capsys, trace)
    _check_what_was_played(trace)
    for output in (tmp_path / "out.csv", tmp_path / "out.npz", tmp_path / "out.mcap", tmp_path / "out"):
        assert main(["export", "last", "--trace", str(trace), "-o", str(output)]) == 0
        played, back = readers.read(trace, "played"), load(output, JOINTS)
        assert np.abs(back.values - played.values).max() < 1e-6
        assert back.times == pytest.approx(played.times, abs=1e-6)


@pytest.mark.skipif(not DEMOS.exists(), reason="the recordings lie outside the repository")
def test_a_real_recording_on_its_own_arm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Kinesthetic teaching of a Panda, which begins in motion, is played from rest and stays near its samples."""
    shown, trace = DEMOS / "robottasks_bottle2shelf_demo0_panda_joints_IK.csv", tmp_path / "trace.rrd"
    table = np.loadtxt(shown, delimiter=",", skiprows=1)
    options = Options(robot_config=PANDA.write(tmp_path))
    with running_cell(options, {"record": trace, "no_live": True}, quiet=True) as cell:

        def volley(*words: str) -> int:
            return main([*words, "--connect", cell.endpoint, "--robot", "other"])

        assert volley("learn", str(shown), "--duration", "10", "--name", "shelf") == 0
        assert "begins moving" in capsys.readouterr().out
        assert volley("reset-sim", "--positions", *(f"{value:.9f}" for value in table[0, 1:])) == 0
        assert volley("goal", "shelf", "--place-time", "0.05", "--wait", "--goal-id", "played") == 0
    played = readers.read(trace, "played")
    samples = np.stack([np.interp(10 * table[:, 0], played.times, column) for column in played.values.T], axis=1)
    bound = np.maximum(0.01 * np.ptp(table[:, 1:], axis=0), 0.005)
    assert played.columns == PANDA.joints
    assert np.all(np.abs(samples - table[:, 1:]).max(axis=0) < bound)


def _check_what_is_cut_out(volley: Callable[..., int], capsys: pytest.CaptureFixture[str], trace: Path) -> None:
    """A part of the trace, while it is being written, is the movement that was played, without rest at its ends."""
    begins, ends = writers.movement()[[0, -1]]

    def near(place: np.ndarray) -> np.ndarray:
        """Times, s on the trace's clock, at which the arm is at a place."""
        times, values = rrd._scan(trace).table()
        return times[np.abs(values - place).max(axis=1) < 1e-4]

    assert eventually(lambda: len(near(ends)) > 50)
    there = near(begins)  # on a busy machine for less than 0.1 s of the robot's time
    begin, end = max(there[0], there[-1] - 0.1), near(ends)[0] + 0.04
    part = ("--trace", str(trace), "--begin", f"{begin:.3f}", "--end", f"{end:.3f}")
    assert volley("teach", "again", *part, "--json") == 0
    learned = msgspec.json.decode(capsys.readouterr().out, type=m.Learned)
    assert learned.duration == pytest.approx(writers.TIMES[-1], abs=0.2)
    for state, shown in zip((learned.start, learned.goal), (begins, ends), strict=True):
        assert state is not None
        assert state.positions == pytest.approx(shown, abs=0.005)
    assert volley("teach", "nothing", "--trace", str(trace), "--begin", str(end + 1000)) == 2
    assert "has no samples there: it lasts from" in capsys.readouterr().err


def _check_what_was_played(trace: Path) -> None:
    """The measured motion is the demonstration's, within 1 % of each joint's range or 5 mrad."""
    played = readers.read(trace, "played")
    shown = np.stack([np.interp(played.times, writers.TIMES, column) for column in writers.movement().T], axis=1)
    bound = np.maximum(0.01 * np.ptp(shown, axis=0), 0.005)
    assert played.columns == JOINTS
    assert np.all(np.abs(played.values - shown).max(axis=0) < bound)
