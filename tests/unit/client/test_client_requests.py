"""Each method sends its request and returns the reply, on the blocking and on the awaited arm alike."""

import asyncio
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from client import AsyncArm, GoalFields, Refusal, connect_async, tool
from client.requests import Requests
from protocol import messages as m
from protocol.codec import matrix_bytes
from protocol.topics import QUERIES
from tests.golden.examples import EXAMPLES
from tests.golden.values import HIT, PIECES

DEMONSTRATION = np.array([[1.0, 2.0], [3.0, 4.0]])
LEARN = m.Learn(
    name="wipe", positions=matrix_bytes(DEMONSTRATION), joint_count=2, times=[0.0, 0.5], smoothing="none", replace=True
)
CASES: list[tuple[Callable[[Any], Any], str, Any]] = [
    (lambda arm: arm.cancel("g1"), "cancel", m.Cancel(goal_id="g1")),
    (lambda arm: arm.cancel(), "cancel", m.Cancel()),
    (lambda arm: arm.reset(), "reset", m.Empty()),
    (lambda arm: arm.recover(), "recover", m.Empty()),
    (lambda arm: arm.hold({"finger": 0.02}), "hold", m.Hold(joints={"finger": 0.02})),
    (lambda arm: arm.result("g1"), "result", m.ResultRequest(goal_id="g1")),
    (lambda arm: arm.forget("wipe"), "forget", m.Forget(name="wipe")),
    (lambda arm: arm.state(), "state", m.Empty()),
    (lambda arm: arm.status(), "status", m.Empty()),
    (lambda arm: arm.reference(0.1), "reference", m.ReferenceRequest(lead=0.1)),
    (lambda arm: arm.step(20), "sim/step", m.Step(ticks=20)),
    (lambda arm: arm.reset_sim(np.array(HIT), seed=7), "sim/reset", m.Reset(positions=HIT, seed=7)),
    (
        lambda arm: arm.disturb("torque", values=(1.0, 2.0), duration=0.1),
        "sim/disturb",
        m.Disturb(kind="torque", values=[1.0, 2.0], duration=0.1),
    ),
    (
        lambda arm: arm.disturb("ball_noise", position_std=0.005, latency_s=0.01, drop_rate=0.1),
        "sim/disturb",
        m.Disturb(kind="ball_noise", position_std=0.005, latency_s=0.01, drop_rate=0.1),
    ),
    (
        lambda arm: arm.throw(np.array([4.0, 0.0, 1.0]), (-6.0, 0.0, 2.0)),
        "sim/ball",
        m.Throw(position=(4.0, 0.0, 1.0), velocity=(-6.0, 0.0, 2.0)),
    ),
    (
        lambda arm: arm.strike((4.0, 0.5, 0.0), count=3, primitives=("forehand",)),
        "strike",
        m.StrikeRequest(target=(4.0, 0.5, 0.0), count=3, primitives=["forehand"]),
    ),
    (lambda arm: arm.stop_striking(), "strike/stop", m.Empty()),
    (
        lambda arm: arm.learn("wipe", DEMONSTRATION, times=np.array([0.0, 0.5]), smoothing="none", replace=True),
        "learn",
        LEARN,
    ),
    (
        lambda arm: arm.plan("forehand", positions=np.array(HIT)),
        "goal",
        m.Goal(primitive="forehand", positions=HIT, plan_only=True),
    ),
    (lambda arm: arm.ask(QUERIES[1], m.Empty()), "primitives", m.Empty()),
]


@pytest.mark.parametrize(("call", "key", "request_"), CASES)
def test_blocking_and_awaited_methods_ask_and_return_the_same(robot, arm, call, key, request_):
    async def awaited() -> object:
        async with connect_async(robot.endpoint) as twin:
            return await call(twin)

    blocking = call(arm)
    assert (robot.asked, type(blocking).__name__ in EXAMPLES) == ([(key, request_)], True)
    assert asyncio.run(awaited()) == blocking
    assert robot.asked == [(key, request_)] * 2


def test_every_request_has_a_method():
    renamed = {"sim/step": "step", "sim/reset": "reset_sim", "sim/disturb": "disturb"}
    renamed |= {"sim/ball": "throw", "strike/stop": "stop_striking"}
    assert [key for key in (renamed.get(q.key, q.key) for q in QUERIES) if not hasattr(Requests, key)] == []


def test_the_fields_of_a_goal_are_those_of_the_contract():
    own = {"version", "primitive", "plan_only", "client_id", "lease"}
    assert set(GoalFields.__annotations__) == set(m.Goal.__struct_fields__) - own
    documented = inspect.getdoc(GoalFields) or ""
    assert [name for name in GoalFields.__annotations__ if f"\n    {name}: " not in documented] == []


def test_primitives_are_a_list(arm):
    assert [entry.name for entry in arm.primitives()] == ["forehand"]


def test_methods_have_signatures_and_docstrings():
    assert str(inspect.signature(AsyncArm.cancel)).startswith("(self, goal_id: 'str | None' = None)")
    assert inspect.iscoroutinefunction(AsyncArm.cancel)
    assert not inspect.iscoroutinefunction(Requests.cancel)
    assert "Stop the arm" in (inspect.getdoc(AsyncArm.cancel) or "")


def test_refusals_carry_code_sentence_and_detail(robot, arm):
    robot.answers["forget"] = [Refusal("unknown_primitive", "there is no primitive 'x'; there is forehand", name="x")]
    with pytest.raises(Refusal, match=r"^there is no primitive 'x'; there is forehand$") as refused:
        arm.forget("x")
    assert (refused.value.code, refused.value.detail) == ("unknown_primitive", {"name": "x"})


def test_a_demonstration_is_a_matrix(arm, robot):
    with pytest.raises(ValueError, match=r"positions has the shape \(3,\); it must be samples × joints"):
        arm.learn("wipe", [1.0, 2.0, 3.0], rate=100.0)
    assert robot.asked == []


def test_a_vector_in_space_has_three_numbers(arm, robot):
    with pytest.raises(ValueError, match="velocity has 2 numbers; a vector in space has 3"):
        arm.throw((4.0, 0.0, 1.0), (-6.0, 0.0))
    with pytest.raises(ValueError, match="orientation has 3 numbers; a quaternion has 4"):
        tool((0.2, -0.9, 1.2), orientation=(1.0, 0.0, 0.0))
    assert robot.asked == []


def test_a_plan_is_executed(robot, arm):
    plan = arm.plan("forehand", include_trajectory=True)
    motion = arm.execute(plan, lead=0.1)
    (_, planned), (_, reference), (key, sent) = robot.asked
    assert (planned.include_trajectory, reference.lead, key) == (True, 0.1, "execute")
    assert (sent.start_time, sent.epoch) == (4.5, 13)
    assert (motion.goal_id, motion.start_time) == ("forehand-7", 4.25)


def test_a_plan_with_thinned_samples_is_executed_as_pieces(robot, arm):
    trajectory = m.Trajectory(**{**_fields(EXAMPLES["Trajectory"]), "pieces": PIECES, "dt": 0.003, "count": 2})
    plan = m.GoalReply(**{**_fields(EXAMPLES["GoalReply"]), "trajectory": trajectory, "duration": 0.002})
    arm.execute(plan)
    sent = robot.asked[0][1]
    assert (sent.pieces, sent.positions, sent.dt, sent.count, sent.hit_index) == (PIECES, None, 0.001, 4, 2)
    with pytest.raises(ValueError, match="include_trajectory=True"):
        arm.execute(m.GoalReply(**{**_fields(plan), "trajectory": None}))


def _fields(message: Any) -> dict[str, Any]:
    return {name: getattr(message, name) for name in message.__struct_fields__}
