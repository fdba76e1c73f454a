"""Goal handles wait, correct and cancel; a lease lasts for its block."""

import asyncio
import threading

import pytest
from msgspec.structs import replace

from client import Refusal, connect_async
from protocol import messages as m
from protocol.topics import ENDED, alive_key
from tests.golden.examples import EXAMPLES
from tests.golden.examples import RESULT as GOOD
from tests.golden.values import HIT
from tools.drill.harness.waiting import PATIENCE_S, eventually

RUNNING = m.Result(goal_id="forehand-7", outcome="running")
LATER_S = 0.2


@pytest.fixture
def impatient(monkeypatch) -> None:
    """Make the client ask soon for a result that is not published."""
    monkeypatch.setattr("client.results.ASK_EVERY_S", 0.05)


def later(call, *arguments) -> None:
    """Call something after LATER_S."""
    threading.Timer(LATER_S, call, arguments).start()


def test_a_published_result_is_not_requested(robot, arm, monkeypatch):
    monkeypatch.setattr("client.results.ASK_EVERY_S", PATIENCE_S)
    robot.then["goal"] = (ENDED, GOOD)
    goal = arm.goal("forehand", positions=HIT)
    assert goal.reply == EXAMPLES["GoalReply"]
    assert goal.wait() == GOOD
    assert [key for key, _ in robot.asked] == ["goal"]


def test_a_result_published_during_the_wait_is_returned(robot, arm, monkeypatch):
    monkeypatch.setattr("client.results.ASK_EVERY_S", PATIENCE_S)
    goal = arm.goal("forehand")
    later(robot.publish, ENDED, GOOD)
    assert goal.wait() == GOOD
    assert [key for key, _ in robot.asked] == ["goal"]


@pytest.mark.usefixtures("impatient")
def test_a_result_whose_publication_was_lost_is_requested(robot, arm):
    robot.answers["result"] = [RUNNING, GOOD]
    robot.publish(ENDED, replace(GOOD, goal_id="another"))
    assert arm.goal("forehand").wait() == GOOD
    assert [key for key, _ in robot.asked] == ["goal", "result", "result"]


def test_an_older_result_with_the_same_id_is_ignored(robot, arm):
    robot.then["goal"] = (ENDED, GOOD)
    assert arm.goal("forehand", goal_id="forehand-7").wait() == GOOD
    robot.answers["result"] = [RUNNING] * 3
    with pytest.raises(TimeoutError, match=r"^goal forehand-7 still runs after 0\.1 s$"):
        arm.goal("forehand", goal_id="forehand-7").wait(0.1)


def test_a_timeout_of_zero_requests_the_result_once(robot, arm):
    robot.answers["result"] = [RUNNING]
    with pytest.raises(TimeoutError):
        arm.goal("forehand").wait(0)
    assert [key for key, _ in robot.asked] == ["goal", "result"]


@pytest.mark.usefixtures("impatient")
def test_a_goal_unknown_to_the_controller_is_refused(robot, arm):
    robot.answers["result"] = [Refusal("unknown_goal", "no goal 'forehand-7' was accepted", goal_id="forehand-7")]
    with pytest.raises(Refusal, match="no goal"):
        arm.goal("forehand").wait()


def test_several_goals_can_be_awaited_at_once(robot):
    async def play() -> list[m.Result]:
        async with connect_async(robot.endpoint) as arm:
            goals = [await arm.goal("forehand") for _ in range(3)]
            later(robot.publish, ENDED, GOOD)
            return await asyncio.gather(*(goal.wait() for goal in goals))

    assert asyncio.run(play()) == [GOOD] * 3


@pytest.mark.usefixtures("impatient")
def test_the_async_client_survives_a_lost_publication(robot):
    async def play() -> m.Result:
        async with connect_async(robot.endpoint) as arm:
            return await (await arm.goal("forehand")).wait()

    robot.answers["result"] = [GOOD]
    assert asyncio.run(play()) == GOOD


def test_a_correction_revises_its_goal(robot, arm):
    goal = arm.goal("forehand", positions=HIT, duration=1.0)
    corrected = goal.correct(positions=[0.0] * 6)
    assert robot.asked[1] == ("goal", m.Goal(primitive="forehand", positions=[0.0] * 6, revises=goal.goal_id))
    assert type(corrected) is type(goal)


def test_a_handle_stops_its_own_motion(robot, arm):
    arm.goal("forehand").cancel()
    assert robot.asked[1] == ("cancel", m.Cancel(goal_id="forehand-7"))


def test_a_lease_is_held_for_its_block(robot, router, arm):
    tokens: list[bool] = []
    router.bus.watch_alive(alive_key("client/*"), lambda _, alive: tokens.append(alive))
    with arm.lease() as name:
        assert eventually(lambda: tokens == [True])
        arm.goal("forehand")
        arm.plan("forehand")
        arm.execute(EXAMPLES["Trajectory"])
    assert eventually(lambda: tokens == [True, False])
    arm.goal("forehand")
    sent = [(request.client_id, request.lease) for _, request in robot.asked]
    assert sent == [(name, True), (name, False), (name, True), (name, False)]


def test_the_last_of_several_blocks_ends_the_lease(robot, router, arm):
    """Blocks may be inside each other, or in threads that share the connection."""
    tokens: list[bool] = []
    router.bus.watch_alive(alive_key("client/*"), lambda _, alive: tokens.append(alive))
    with arm.lease() as name:
        with arm.lease() as inner:
            assert inner == name
        assert arm.holds_lease
        arm.goal("forehand")
    assert not arm.holds_lease
    assert eventually(lambda: tokens == [True, False])
    assert [(request.client_id, request.lease) for _, request in robot.asked] == [(name, True)]
