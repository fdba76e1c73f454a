"""`volley learn`: the request that it sends for recordings, its flags and its plot; `teach` beside it."""

from pathlib import Path

import numpy as np
import pytest

from protocol import messages as m
from protocol.codec import matrix_bytes
from tests.golden.values import JOINTS
from tests.unit.shell.command_line import volley
from tools.shell.__main__ import main
from tools.trace_reader import read_trace


@pytest.mark.parametrize(
    ("flags", "sentence"),
    [
        (("--smoothing", "none", "--window", ".2"), "--smoothing none and --window 0.2 both set the smoothing"),
        (("--smoothing", "auto", "--window", ".2"), "--smoothing auto and --window 0.2 both set the smoothing"),
        (("--order", "3"), "--order 3 is that of the filter of --window"),
        (("other.csv", "--plot", "out.png"), "--plot draws one recording; learn has 2 files"),
    ],
)
def test_a_flag_of_learn_without_effect_is_refused(robot, capsys, flags, sentence):
    assert volley(robot, "learn", "swing.csv", *flags) == 2
    assert sentence in " ".join(capsys.readouterr().err.replace("│", " ").split())


def swing(count):
    s = np.linspace(0, 1, count)[:, None]
    return s**3 * (10 + s * (6 * s - 15))


def test_learn_sends_a_matrix_in_rad_and_in_the_arms_joint_order(robot, tmp_path, capsys):
    file = tmp_path / "My wipe, 2.csv"
    order = JOINTS[::-1]
    degrees = swing(41) * np.arange(5.0, 35.0, 5.0)
    rows = [",".join([str(10 * k), *map(str, row[::-1])]) for k, row in enumerate(degrees.tolist())]
    file.write_text("\n".join([",".join(["t_ms", *(f"{joint}_deg" for joint in order)]), *rows]))
    assert volley(robot, "learn", str(file), "--window", ".2", "--order", "3", "--replace") == 0
    learn = m.Learn(
        name="My-wipe-2",
        positions=matrix_bytes(np.radians(degrees)),
        joint_count=6,
        joint_names=JOINTS,
        times=(np.arange(0.0, 410.0, 10.0) * 1e-3).tolist(),
        smoothing=m.SavitzkyGolay(window_s=0.2, order=3),
        replace=True,
    )
    assert robot.asked == [("learn", learn)]
    assert "My wipe, 2, 41 samples, 0.400 s" in capsys.readouterr().err


def test_follow_spread_sends_the_spread_of_several_recordings(robot, tmp_path, capsys):
    files = [tmp_path / f"swing{number}.csv" for number in range(3)]
    for number, file in enumerate(files):
        table = np.column_stack([0.01 * np.arange(81), swing(81) * (np.arange(1.0, 7.0) / 10 + 0.01 * number)])
        np.savetxt(file, table, delimiter=",", header=",".join(["time", *JOINTS]), comments="")
    assert volley(robot, "learn", *map(str, files)) == 0
    assert volley(robot, "learn", *map(str, files), "--follow-spread") == 0
    (_, plain), (_, weighted) = robot.asked[:2]
    assert plain.spread is None
    assert np.shape(weighted.spread) == (100, 6)
    assert 0.009 < weighted.spread[-1][0] < 0.012
    assert "differs most" not in capsys.readouterr().err
    other = np.column_stack([0.01 * np.arange(81), -swing(81) * np.arange(1.0, 7.0) / 10])
    np.savetxt(files[2], other, delimiter=",", header=",".join(["time", *JOINTS]), comments="")
    assert volley(robot, "learn", *map(str, files)) == 0
    assert f"{files[2]} differs most: leave it out if it shows another movement" in capsys.readouterr().err
    assert volley(robot, "learn", str(files[0]), "--follow-spread") == 2
    assert "--follow-spread needs several recordings" in capsys.readouterr().err


def test_learn_needs_an_episode_and_a_mapping_if_they_are_ambiguous(robot, tmp_path, capsys):
    file = tmp_path / "demos.npz"
    np.savez(file, t=np.arange(20) / 50, qpos=np.tile(swing(20) * np.arange(12.0) / 20, (3, 1, 1)))
    assert volley(robot, "learn", str(file)) == 2
    assert "has 3 episodes; choose one with --episode: qpos[0], qpos[1], qpos[2]" in capsys.readouterr().err
    assert main(["episodes", str(file)]) == 0
    listed = capsys.readouterr().out.split()
    assert listed[-3:] == ["qpos[2]", "20", "0.38"]
    assert volley(robot, "learn", str(file), "--episode", "2") == 2
    assert "name them with --map 0=joint_1" in capsys.readouterr().err
    maps = [word for k, joint in enumerate(JOINTS) for word in ("--map", f"{k + 6}={joint}")]
    assert volley(robot, "learn", str(file), "--episode", "2", *maps, "--name", "right") == 0
    (_, learn), *_ = robot.asked
    assert isinstance(learn, m.Learn)
    assert learn.positions == matrix_bytes(swing(20) * np.arange(6.0, 12.0) / 20)


def test_a_plot_shows_the_smoothing_that_is_learned(robot, tmp_path, capsys):
    recording, picture = tmp_path / "swing.csv", tmp_path / "swing.rrd"
    values = swing(201) * np.arange(1.0, 7.0) / 10 + 0.002 * np.random.default_rng(1).normal(size=(201, 6))
    table = np.column_stack([0.01 * np.arange(201), values])
    np.savetxt(recording, table, delimiter=",", header=",".join(["time", *JOINTS]), comments="")
    curves = {}
    for smoothing in ("auto", "none"):
        assert volley(robot, "learn", str(recording), "--smoothing", smoothing, "--plot", str(picture)) == 0
        curves[smoothing] = read_trace(picture).scalars(f"/preview/{JOINTS[0]}/fitted")
    assert np.abs(curves["none"] - curves["auto"]).max() > 0.001


def test_teach_refuses_a_name_in_use_before_guiding_the_arm(robot, capsys):
    assert volley(robot, "teach", "forehand", "--seconds", "1") == 1
    assert "there is a primitive 'forehand'; take another name, or overwrite it" in capsys.readouterr().err
    assert [key for key, _ in robot.asked] == ["primitives"]


def test_teach_without_anybody_who_can_press_enter_names_the_flag(robot, capsys, monkeypatch):
    """A program without a terminal has an empty standard input, which would end the recording at once."""
    with Path("/dev/null").open(encoding="utf-8") as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        assert volley(robot, "teach", "wave") == 2
    assert "nobody can press Enter, because standard input is empty; give --seconds" in capsys.readouterr().err
    assert robot.asked == []
