"""Commands with a stub robot on real Zenoh: requests, output and exit statuses."""

import json

import pytest

from protocol import messages as m
from protocol.errors import Refusal
from protocol.topics import ENDED, QUERIES, alive_key
from tests.golden.values import HIT, RESULT
from tests.unit.shell.command_line import WORDS, volley
from tools.drill.harness.waiting import eventually
from tools.shell.__main__ import COMMANDS

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
    ("outcome", "status"), [("succeeded", 0), ("missed", 1), ("aborted", 1), ("canceled", 1), ("preempted", 1)]
)
def test_wait_exits_with_the_status_of_the_outcome(robot, capsys, outcome, status):
    robot.then["goal"] = ENDED, m.Result(goal_id="forehand-7", outcome=outcome, reason="because")
    assert volley(robot, "goal", "forehand", "--positions", *WORDS, "--wait") == status
    assert [key for key, _ in robot.asked] == ["goal"]
    assert f"{outcome} · because" in capsys.readouterr().out
    robot.answers["result"] = [m.Result(goal_id="forehand-7", outcome=outcome, reason="because")]
    assert volley(robot, "result", "forehand-7") == status


def test_the_result_of_a_running_goal_exits_with_1(robot):
    robot.answers["result"] = [m.Result(goal_id="forehand-7", outcome="running")]
    assert volley(robot, "result", "forehand-7") == 1


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
