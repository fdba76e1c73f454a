"""Help, wrong usage, an absent robot: sentences, exit statuses, and what is imported for them."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.shell.command_line import volley
from tools.shell.__main__ import COMMANDS, main


def test_help_names_every_command_and_imports_little(capsys):
    assert main(["--help"]) == 0
    listed = capsys.readouterr().out
    assert [name for name in COMMANDS if f"  {name} " not in listed] == []
    assert "Exit status: 0 success; 1 refused" in listed
    code = "import sys, tools.shell.__main__ as shell; shell.main([]); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"tyro", "rich", "zenoh", "msgspec", "numpy"} & set(loaded)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_under_its_own_name(name, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["volley"])
    with pytest.raises(SystemExit) as stopped:
        main([name, "--help"])
    assert stopped.value.code in (0, None)
    assert capsys.readouterr().out.startswith(f"usage: volley {name} [-h]")


def test_an_unknown_command_is_refused_in_a_sentence(capsys):
    assert main(["fly"]) == 2
    assert capsys.readouterr().err == "volley: there is no command 'fly'; volley --help lists them\n"


def test_the_installed_script_runs_the_same_program():
    script = Path(sys.executable).with_name("volley")
    done = subprocess.run([script, "fly"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.startswith("volley: there is no command 'fly'")) == (2, True)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["goal", "forehand", "--positions", "1", "two"], "--positions: 'two' is not a finite number"),
        (["goal", "forehand", "--plan-only", "--wait"], "--plan-only moves nothing"),
        (["goal", "forehand", "--save", "absent/plan"], "--save absent/plan: there is no directory absent"),
        (["disturb", "loss"], "disturb loss needs --duration and --stream"),
        (["reset-sim", "--ball-velocity", "1", "0", "0"], "--ball-velocity needs --ball"),
        (["learn", "absent.csv"], "absent.csv cannot be read: No such file or directory"),
        (["learn", "absent.csv", "--map", "elbow"], "--map elbow: write THEIRS=OURS"),
        (["learn", "absent.csv", "--rate", "50", "--duration", "2"], "both set the times"),
        (["teach", "wave", "--seconds", "nan"], "--seconds is nan; it must be a number greater than 0"),
        (["teach", "wave", "--robot-config", "my.toml"], "--robot-config my.toml is the arm that --drag shows"),
        (["teach", "my wave"], "NAME 'my wave' must be 1 to 64 letters"),
        (["teach", "wave", "--plot", "absent/x.png"], "--plot absent/x.png: there is no directory absent"),
        (["teach", "wave", "--trace", "x.rrd", "--begin", "3", "--end", "2"], "--begin 3 is not before --end 2"),
        (["status", "--zenoh-config", "absent.json5"], "absent.json5 is not a Zenoh configuration"),
    ],
)
def test_usage_errors_are_reported_in_a_sentence_and_exit_with_2(robot, capsys, words, sentence):
    assert volley(robot, *words) == 2
    printed, complained = capsys.readouterr()
    assert sentence in complained
    assert (printed, complained.count("\n"), robot.asked) == ("", 1, [])


def test_wrong_flags_exit_with_2(robot, capsys):
    with pytest.raises(SystemExit) as stopped:
        volley(robot, "goal", "forehand", "--method", "guess")
    assert stopped.value.code == 2
    assert "--method" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["goal", "result", "execute", "learn", "teach", "forget"])
def test_an_endpoint_is_never_taken_for_a_missing_name(robot, capsys, name):
    """`learn` says in a sentence what it needs; the others show the missing argument."""
    try:
        status = volley(robot, name)
    except SystemExit as stopped:
        status = stopped.code
    complained = capsys.readouterr().err
    assert (status, robot.asked) == (2, [])
    assert "Required options" in complained or "learn needs a FILE" in complained


def test_flags_may_come_before_a_name(robot):
    assert main(["cancel", "--connect", robot.endpoint, "g1"]) == 0
    assert [key for key, _ in robot.asked] == ["cancel"]


@pytest.mark.parametrize("words", [("primitives",), ("watch",), ("learn", "no-such-file.csv"), ("drag",)])
def test_an_absent_robot_is_reported_at_once(robot, capsys, monkeypatch, words):
    monkeypatch.setattr("tools.shell.dragging.check_display", lambda: None)
    token = robot.bus.announce("sim")
    try:
        assert volley(robot, *words, "--robot", "leg") == 2
    finally:
        token.undeclare()
    assert capsys.readouterr().err == "no robot has the name 'leg' on this bus; choose from 'arm'\n"
    assert not robot.asked


def test_a_missing_answer_exits_with_4(robot, capsys):
    assert volley(robot, "status", "--robot", "leg") == 4
    assert "no answer on volley/leg/status: the controller is not running" in capsys.readouterr().err
    assert main(["status", "--connect", "tcp/127.0.0.1:1"]) == 4
    assert "no router at tcp/127.0.0.1:1: start the robot with volley up" in capsys.readouterr().err
