"""Plans are saved by `volley goal --save` and played by `volley execute`."""

from msgspec.structs import replace

from protocol import messages as m
from protocol.codec import encode
from tests.golden.examples import EXAMPLES
from tests.golden.values import PIECES
from tests.unit.shell.command_line import WORDS, volley


def test_a_plan_is_saved_and_executed(robot, tmp_path):
    file = str(tmp_path / "plan.msgpack")
    assert volley(robot, "goal", "forehand", "--positions", *WORDS, "--plan-only", "--save", file) == 0
    assert volley(robot, "execute", file) == 0
    assert robot.asked[1] == ("execute", EXAMPLES["Trajectory"])
    assert volley(robot, "execute", file, "--lead", ".1", "--wait") == 0
    assert [key for key, _ in robot.asked[2:]] == ["reference", "execute", "result"]
    sent = robot.asked[3][1]
    assert isinstance(sent, m.Trajectory)
    assert (sent.start_time, sent.epoch) == (4.5, 13)


def test_a_plan_that_cannot_be_saved_is_reported(robot, tmp_path, capsys):
    robot.answers["goal"] = [replace(EXAMPLES["GoalReply"], trajectory=EXAMPLES["Trajectory"])]
    assert volley(robot, "goal", "forehand", "--plan-only", "--save", str(tmp_path)) == 2
    assert f"--save {tmp_path} cannot be written: Is a directory" in capsys.readouterr().err


def test_a_plan_with_thinned_samples_is_saved_as_pieces(robot, tmp_path):
    """The reply of a long plan has every nth sample, which `execute` refuses."""
    apart = replace(EXAMPLES["Trajectory"], pieces=PIECES, dt=0.003, count=2, hit_index=1)
    robot.answers["goal"] = [replace(EXAMPLES["GoalReply"], trajectory=apart, duration=0.002)]
    file = str(tmp_path / "plan.msgpack")
    assert volley(robot, "goal", "forehand", "--plan-only", "--save", file) == 0
    assert volley(robot, "execute", file) == 0
    sent = robot.asked[1][1]
    assert isinstance(sent, m.Trajectory)
    assert (sent.pieces, sent.positions, sent.velocities, sent.accelerations) == (PIECES, None, None, None)
    assert (sent.dt, sent.count, sent.hit_index) == (0.001, 4, 2)


def test_execute_refuses_a_file_without_a_trajectory(robot, tmp_path, capsys):
    file = tmp_path / "plan.msgpack"
    file.write_bytes(encode(m.Step(ticks=1)))
    assert volley(robot, "execute", str(file)) == 2
    assert "plan.msgpack holds no trajectory: ticks is not a known field" in capsys.readouterr().err
    assert volley(robot, "execute", str(tmp_path / "absent")) == 2
    assert "absent cannot be read: No such file or directory" in capsys.readouterr().err
    assert robot.asked == []
