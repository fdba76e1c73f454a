"""Every command with a stub robot on real Zenoh: requests, output and exit statuses."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from protocol import messages as m
from protocol.codec import encode, matrix_bytes
from protocol.errors import Refusal
from protocol.topics import ENDED, QUERIES, STATUS, alive_key
from tests.golden.examples import EXAMPLES, HIT, JOINTS, PIECES, RESULT
from tests.stub import Stub
from tests.waiting import PATIENCE_S, eventually
from tools.shell.__main__ import COMMANDS, main

WORDS = [f"{value}" for value in HIT]


def volley(robot: Stub, *words: str) -> int:
    """Run a command line against the stub."""
    return main([*words, "--connect", robot.endpoint])


PUSH = ["100", "0", "0", "0", "0", "0"]


@pytest.mark.parametrize(
    ("words", "key", "request_", "said"),
    [
        (["primitives"], "primitives", m.Empty(), "forehand"),
        (["forget", "wipe"], "forget", m.Forget(name="wipe"), "forgot wipe"),
        (["reference", "--lead", ".1"], "reference", m.ReferenceRequest(lead=0.1), "epoch 13"),
        (["cancel"], "cancel", m.Cancel(), "stopping goal forehand-7"),
        (["cancel", "g1"], "cancel", m.Cancel(goal_id="g1"), "at rest at 4.750 s"),
        (["reset"], "reset", m.Empty(), "the controller is holding"),
        (["result", "g1"], "result", m.ResultRequest(goal_id="g1"), "succeeded"),
        (["status"], "status", m.Empty(), "99.95 % on time"),
        (["state"], "state", m.Empty(), "tick 4500 of run"),
        (["description"], "description", None, "stepped clock"),
        (["step", "250"], "sim/step", m.Step(ticks=250), "tick 4750"),
        (["recover"], "recover", m.Empty(), "the arm is ready"),
        (["hold", "a", "-.5", "b", "1"], "hold", m.Hold(joints={"a": -0.5, "b": 1.0}), "leading finger to 0.03125"),
        (["reset-sim", "--seed", "7"], "sim/reset", m.Reset(seed=7), "run 7 begins"),
        (
            ["reset-sim", "--positions", *WORDS, "--ball", "1", "0", "1.5", "--ball-velocity", "-3", "0", "0"],
            "sim/reset",
            m.Reset(positions=HIT, ball=m.Ball(position=(1.0, 0.0, 1.5), velocity=(-3.0, 0.0, 0.0))),
            "run 7 begins",
        ),
        (
            ["disturb", "acceleration", "--values", *PUSH, "--duration", ".2", "--at", "3"],
            "sim/disturb",
            m.Disturb(kind="acceleration", values=[100.0, 0, 0, 0, 0, 0], duration=0.2, start_time=3.0),
            "disturbs from 4.500 s on",
        ),
        (
            ["disturb", "noise", "--position-std", ".001", "--velocity-std", ".01"],
            "sim/disturb",
            m.Disturb(kind="sensor_noise", position_std=0.001, velocity_std=0.01),
            "disturbs",
        ),
        (
            ["disturb", "ball-noise", "--position-std", ".005", "--latency", ".01"],
            "sim/disturb",
            m.Disturb(kind="ball_noise", position_std=0.005, latency_s=0.01),
            "disturbs",
        ),
        (
            ["ball", "--position", "4", "0", "1", "--velocity", "-6", "0", "2"],
            "sim/ball",
            m.Throw(position=(4.0, 0.0, 1.0), velocity=(-6.0, 0.0, 2.0), spin=(0.0, 0.0, 0.0)),
            "the ball flies from 4.500 s on",
        ),
        (
            ["strike", "4", ".5", "0", "--count", "3"],
            "strike",
            m.StrikeRequest(target=(4.0, 0.5, 0.0), count=3),
            "the striker returns balls",
        ),
        (["strike", "--stop"], "strike/stop", m.Empty(), "the striker returns balls"),
        (
            ["disturb", "loss", "--stream", "command", "--duration", ".05"],
            "sim/disturb",
            m.Disturb(kind="loss", stream="command", duration=0.05),
            "disturbs",
        ),
        (
            ["goal", "forehand", "--positions", *WORDS, "--duration", ".8"],
            "goal",
            m.Goal(primitive="forehand", positions=HIT, duration=0.8),
            "planned in 3.8 ms",
        ),
        (
            ["goal", "forehand", "--tolerance", ".01", "--velocity-tolerance", ".1"],
            "goal",
            m.Goal(primitive="forehand", tolerance=m.Tolerance(positions=0.01, velocities=0.1)),
            "planned in 3.8 ms",
        ),
        (
            ["goal", "forehand", "--revises", "g1", "--alternative", "@12.5:", "--follow-through", ".1"],
            "goal",
            m.Goal(
                primitive="forehand",
                revises="g1",
                alternatives=[m.Alternative(arrival_time=12.5)],
                follow_through=0.1,
            ),
            "plays alternative 2",
        ),
    ],
)
def test_a_command_sends_its_request_and_prints_the_reply(robot, capsys, words, key, request_, said):
    assert volley(robot, *words) == 0
    assert robot.asked == ([(key, request_)] if request_ else [])
    assert said in capsys.readouterr().out


def test_every_request_has_a_command():
    keys = {query.key for query in QUERIES}
    renamed = {"sim/step": "step", "sim/reset": "reset-sim", "sim/disturb": "disturb", "guide": "teach"}
    renamed |= {"sim/ball": "ball", "strike/stop": "strike"}
    own = {"watch", "robot", "episodes", "export", "inspect", "drag"}
    own |= {name for name, command in COMMANDS.items() if command.is_main}
    assert {renamed.get(key, key) for key in keys} | own == set(COMMANDS)


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


def test_the_description_is_requested_only_if_one_value_stands_for_all_joints(robot, capsys):
    assert volley(robot, "goal", "forehand", "--positions", *WORDS, "--json") == 0
    assert robot.described == 0
    assert volley(robot, "goal", "forehand", "--limit-velocities", "8", "--json") == 0
    assert robot.described == 1
    sent = robot.asked[1][1]
    assert isinstance(sent, m.Goal)
    assert (sent.limits and sent.limits.velocities) == [8.0] * 6


def test_json_prints_the_reply(robot, capsys):
    assert volley(robot, "status", "--json") == 0
    lines = capsys.readouterr().out.splitlines()
    assert [json.loads(line)["mode"] for line in lines] == ["tracking"]


@pytest.mark.parametrize(
    ("flags", "sentence"),
    [
        (("--smoothing", "none", "--window", ".2"), "--smoothing none and --window 0.2 both set the smoothing"),
        (("--smoothing", "auto", "--window", ".2"), "--smoothing auto and --window 0.2 both set the smoothing"),
        (("--order", "3"), "--order 3 is that of the filter of --window"),
    ],
)
def test_contradictory_flags_of_smoothing_are_refused(robot, capsys, flags, sentence):
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
    (_, plain), (_, weighted) = robot.asked
    assert plain.spread is None
    assert np.shape(weighted.spread) == (100, 6)
    assert 0.009 < weighted.spread[-1][0] < 0.012
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


@pytest.mark.parametrize(
    ("outcome", "status"), [("succeeded", 0), ("missed", 1), ("aborted", 1), ("canceled", 1), ("preempted", 1)]
)
def test_wait_exits_with_the_status_of_the_outcome(robot, capsys, outcome, status):
    robot.then["goal"] = ENDED, m.Result(goal_id="forehand-7", outcome=outcome, reason="because")
    assert volley(robot, "goal", "forehand", "--positions", *WORDS, "--wait") == status
    assert [key for key, _ in robot.asked] == ["goal"]
    assert f"{outcome} · because" in capsys.readouterr().out


def test_a_lease_is_held_until_the_motion_has_ended(robot, router):
    running = m.Result(goal_id="forehand-7", outcome="running")
    robot.answers["result"] = [running, RESULT]
    tokens: list[tuple[int, bool]] = []
    router.bus.watch_alive(alive_key("client/me"), lambda key, alive: tokens.append((len(robot.asked), alive)))
    assert volley(robot, "goal", "forehand", "--positions", *WORDS, "--lease", "--client-id", "me") == 0
    assert eventually(lambda: len(tokens) == 2)
    (_, first), (asked, last) = tokens
    assert (first, last, asked) == (True, False, 3)
    sent = robot.asked[0][1]
    assert isinstance(sent, m.Goal)
    assert (sent.client_id, sent.lease) == ("me", True)


def test_a_refusal_is_printed_and_exits_with_1(robot, capsys):
    refusal = Refusal("unknown_primitive", "there is no primitive 'backhand'; there is forehand", name="backhand")
    robot.answers["forget"] = [refusal, refusal]
    assert volley(robot, "forget", "backhand") == 1
    assert capsys.readouterr() == ("", "unknown_primitive: there is no primitive 'backhand'; there is forehand\n")
    assert volley(robot, "forget", "backhand", "--json") == 1
    assert json.loads(capsys.readouterr().err)["detail"] == {"name": "backhand"}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["goal", "forehand", "--positions", "1", "two"], "--positions: 'two' is not a finite number"),
        (["goal", "forehand", "--plan-only", "--wait"], "--plan-only moves nothing"),
        (["goal", "forehand", "--save", "absent/plan"], "--save absent/plan: there is no directory absent"),
        (["disturb", "noise"], "disturb noise needs --position-std and --velocity-std"),
        (["reset-sim", "--ball-velocity", "1", "0", "0"], "--ball-velocity needs --ball"),
        (["learn", "absent.csv"], "absent.csv cannot be read: No such file or directory"),
        (["learn", "absent.csv", "--map", "elbow"], "--map elbow: write THEIRS=OURS"),
        (["learn", "absent.csv", "--rate", "50", "--duration", "2"], "both set the times"),
        (["teach", "wave", "--seconds", "nan"], "--seconds is nan; it must be a number greater than 0"),
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


@pytest.mark.parametrize(
    ("words", "terminal", "shown"), [([], "1", b"tracking"), (["--json"], "0", b"tracking"), ([], "0", b"events")]
)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_watch_ends_cleanly_on_a_signal(robot, router, words, terminal, shown, number):
    """After it has shown a status; without a terminal it prints only the last screen."""
    publisher = router.publishers[STATUS.key]
    command = [Path(sys.executable).with_name("volley"), "watch", "--connect", router.endpoint, *words]
    environment = os.environ | {"PYTHONUNBUFFERED": "1", "TTY_COMPATIBLE": terminal}
    listened = router.bus.session.declare_publisher(router.bus.key(STATUS.key))
    assert eventually(lambda: not listened.matching_status.matching), "the process of another test still listens"
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment) as process:
        try:
            assert eventually(lambda: listened.matching_status.matching)
            output, printed = process.stdout, b""
            assert output is not None
            os.set_blocking(output.fileno(), False)

            def has_shown() -> bool:
                nonlocal printed
                publisher.put(EXAMPLES["Status"])
                printed += output.read() or b""
                return shown in printed

            if shown == b"tracking":
                assert eventually(has_shown)
            process.send_signal(number)
            os.set_blocking(output.fileno(), True)
            rest, complained = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert (process.returncode, complained) == (0, b"")
    assert shown in printed + rest


@pytest.mark.parametrize("words", [["--help"], ["goal", "--help"]])
def test_a_closed_pipe_prints_no_error(words):
    """For example in `volley goal --help | head -1`."""
    reading, writing = os.pipe()
    os.close(reading)
    command = [Path(sys.executable).with_name("volley"), *words]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


def test_the_shell_imports_neither_motion_nor_mujoco():
    code = "import sys, tools.shell.__main__; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"motion", "mujoco", "rerun", "scipy", "piqp"} & set(loaded)


def test_teach_refuses_a_name_in_use_before_guiding_the_arm(robot, capsys):
    assert volley(robot, "teach", "forehand", "--seconds", "1") == 1
    assert "there is a primitive 'forehand'; take another name, or overwrite it" in capsys.readouterr().err
    assert [key for key, _ in robot.asked] == ["primitives"]
