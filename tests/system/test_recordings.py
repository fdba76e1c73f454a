"""A file of another program becomes a motion, and the motion is read back from its trace, by shell commands alone."""

import shlex
from collections.abc import Callable, Iterator
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
from tests.cores import LOOP_CORE
from tests.unit.recordings import writers
from tests.unit.recordings.playing import HOUSEHOLD, relative_deviation
from tools.drill.harness.waiting import eventually
from tools.recordings import readers
from tools.recordings.doctor import examine
from tools.recordings.learning import load
from tools.recordings.readers import rrd
from tools.shell.__main__ import main

JOINTS = load_robot().joint_names


def test_from_a_file_to_a_motion_and_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Eleven demonstrations without names or times: one is chosen, learned, played, exported and learned again."""
    source, trace = tmp_path / "low_dim.hdf5", tmp_path / "trace.rrd"
    writers.write_robomimic(source)
    with running_cell(Options(loop_core=LOOP_CORE), {"record": trace, "no_live": True}, quiet=True) as cell:

        def volley(*words: str) -> int:
            return main([*words, "--connect", cell.endpoint])

        assert volley("learn", str(source)) == 2
        assert "choose one with --episode: demo_0, demo_1" in capsys.readouterr().err
        assert volley("learn", str(source), "--episode", "demo_0", "--name", "reach") == 0
        begin = " ".join(f"{value:.6f}" for value in writers.movement()[0])
        assert f"volley reset-sim --positions {begin}" in capsys.readouterr().err
        start = [f"{value:.9f}" for value in writers.movement()[0]]
        assert volley("reset-sim", "--positions", *start) == 0
        assert eventually(lambda: len(_times_near(trace, writers.movement()[0])) > 50)
        assert volley("goal", "reach", "--wait", "--goal-id", "played") == 0
        assert "succeeded" in capsys.readouterr().out
        _check_what_is_cut_out(volley, capsys, trace)
        assert volley("learn", str(trace), "--episode", "played", "--name", "copy") == 0
        assert volley("reset-sim", "--positions", *start) == 0
        assert volley("goal", "copy", "--wait", "--goal-id", "copied") == 0
    for goal in ("played", "copied"):
        _check_what_was_played(trace, goal)
    played = readers.read(trace, "copied")
    for output in (tmp_path / "out.csv", tmp_path / "out.npz", tmp_path / "out.mcap", tmp_path / "out"):
        assert main(["export", "last", "--trace", str(trace), "-o", str(output)]) == 0
        back = load(output, JOINTS)
        assert np.abs(back.values - played.values).max() < 1e-6
        assert back.times == pytest.approx(played.times, abs=1e-6)


@pytest.fixture(scope="module")
def panda(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """Yield the endpoint of a Panda's services, and its trace."""
    folder = tmp_path_factory.mktemp("panda")
    trace = folder / "trace.rrd"
    options = Options(robot_config=PANDA.write(folder), loop_core=LOOP_CORE)
    with running_cell(options, {"record": trace, "no_live": True}, quiet=True) as cell:
        yield cell.endpoint, trace


@pytest.mark.skipif(not DEMOS.exists(), reason="the recordings lie outside the repository")
@pytest.mark.parametrize(("task", "duration"), HOUSEHOLD.items())
def test_a_real_recording_on_its_own_arm(
    panda: tuple[str, Path], capsys: pytest.CaptureFixture[str], task: str, duration: float
) -> None:
    """Kinesthetic teaching of a Panda, which begins in motion, is played from rest and stays near its samples."""
    endpoint, trace = panda
    (shown,) = DEMOS.glob(f"robottasks_{task}_*.csv")

    def volley(*words: str) -> int:
        return main([*words, "--connect", endpoint, "--robot", "other"])

    assert volley("learn", str(shown), "--duration", str(duration), "--name", task) == 0
    printed = capsys.readouterr()
    assert "begins moving" in printed.out
    assert main(shlex.split(printed.err.partition("or for a simulated arm volley ")[2])) == 0
    assert volley("goal", task, "--place-time", "0.05", "--wait", "--goal-id", f"played-{task}") == 0
    played, samples = readers.read(trace, f"played-{task}"), load(shown, PANDA.joints, duration=duration)
    samples = examine(samples, load_robot(PANDA.write(trace.parent))).recording
    at = samples.times - samples.times[0]
    measured = np.stack([np.interp(at, played.times, column) for column in played.values.T], axis=1)
    assert played.columns == PANDA.joints
    assert relative_deviation(measured, samples.values).max() < 1


def _times_near(trace: Path, place: np.ndarray) -> np.ndarray:
    """Return the times, s on the trace's clock, at which the arm is at a place, in a trace that is being written."""
    times, values = rrd.scan_of(trace).table()
    return times[np.abs(values - place).max(axis=1) < 1e-4]


def _check_what_is_cut_out(volley: Callable[..., int], capsys: pytest.CaptureFixture[str], trace: Path) -> None:
    """A part of the trace, cut while it is written, is the movement that was played, without rest at its ends."""
    begins, ends = writers.movement()[[0, -1]]
    assert eventually(lambda: len(_times_near(trace, ends)) > 50)
    there, after = _times_near(trace, begins), _times_near(trace, ends)
    begin, end = max(there[0], there[-1] - 0.1), after[0] + 0.04
    part = ("--trace", str(trace), "--begin", f"{begin:.3f}", "--end", f"{end:.3f}")
    assert volley("teach", "again", *part, "--json") == 0
    learned = msgspec.json.decode(capsys.readouterr().out, type=m.Learned)
    assert learned.duration == pytest.approx(writers.TIMES[-1], abs=0.2)
    for state, shown in zip((learned.start, learned.goal), (begins, ends), strict=True):
        assert state is not None
        assert state.positions == pytest.approx(shown, abs=0.005)
    assert volley("teach", "nothing", "--trace", str(trace), "--begin", str(end + 1000)) == 2
    assert "has no samples there: it lasts from" in capsys.readouterr().err


def _check_what_was_played(trace: Path, goal: str) -> None:
    """The measured motion is the demonstration's, within 1 % of each joint's range or 5 mrad."""
    played = readers.read(trace, goal)
    shown = np.stack([np.interp(played.times, writers.TIMES, column) for column in writers.movement().T], axis=1)
    assert played.columns == JOINTS
    assert relative_deviation(played.values, shown).max() < 1
