"""Motions sent as polynomials, and requests that were put instead of asked."""

from typing import Any

import numpy as np
import pytest
import zenoh
from harness import PATIENCE_S, ROBOT, Reference, Stack, wait_for

from motion.trajectory import Trajectory
from protocol import messages as m
from protocol import topics
from protocol.codec import matrix_bytes
from protocol.errors import Refusal

HALF_S, WAY = 0.4, -0.25


def motion() -> Trajectory:
    """Return a motion of the first joint away from home and back, at rest in between and at the end."""
    coefficients = np.zeros((3, ROBOT.joint_count, m.COEFFICIENTS))
    coefficients[:, :, 0] = ROBOT.home
    coefficients[1, 0, 0] += WAY
    for piece, way in ((0, WAY), (1, -WAY)):
        coefficients[piece, 0, 3:] = way * np.array([10.0, -15.0, 6.0]) / HALF_S ** np.arange(3, 6)
    return Trajectory(np.array([0.0, HALF_S, 2 * HALF_S, 2 * HALF_S]), coefficients)


def execute(stack: Stack, made: Trajectory, **fields: object) -> m.Accepted:
    """Send a motion to the controller that starts 20 ticks from now."""
    now = stack.bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=0.02))
    said: dict[str, Any] = {
        "goal_id": f"polynomials {stack.run}", "epoch": now.epoch, "joint_names": list(ROBOT.joint_names),
        "start_time": now.time, "dt": ROBOT.tick, "count": round(made.duration * ROBOT.rate_hz) + 1, "hit_index": 400,
        "pieces": m.Pieces(breaks=made.breaks.tolist(), coefficients=matrix_bytes(made.coefficients)),
    }  # fmt: skip
    return stack.bus.ask(topics.EXECUTE, m.Trajectory(**{**said, **fields}))


def test_polynomials_are_played(stack: Stack):
    """The commands equal the polynomials at every tick, and `reference` names the goal of each instant."""
    accepted = execute(stack, motion())
    first = stack.ticks(accepted.start_time)
    stack.step_to(first + 100)
    ahead = [stack.bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=lead)) for lead in (0.0, 0.5, 0.9)]
    assert [reference.goal_id for reference in ahead] == [accepted.goal_id, accepted.goal_id, None]
    stack.step_to(first + 900)
    result = stack.result(accepted.goal_id)
    assert result.outcome == "succeeded"
    assert result.hit is not None
    assert max(map(abs, result.hit.position_error)) < 1e-4
    played = Reference(stack.commands())
    wanted = motion().sample(np.arange(801) * ROBOT.tick)
    assert np.array_equal(played.positions[first : first + 801], wanted.positions)
    assert np.array_equal(played.velocities[first : first + 801], wanted.velocities)
    played.check_smooth()
    played.check_limits()


def test_a_motion_of_a_minute(stack: Stack):
    """A minute as polynomials fits into a request easily and is accepted; it can be cancelled."""
    made = motion()
    breaks = [*made.breaks[:-1].tolist(), 60.0]
    pieces = m.Pieces(breaks=breaks, coefficients=matrix_bytes(made.coefficients))
    accepted = execute(stack, made, pieces=pieces, count=60_001)
    stack.step_to(stack.ticks(accepted.start_time) + 200)
    canceled = stack.cancel()
    assert canceled.goal_id == accepted.goal_id
    assert stack.bus.ask(topics.REFERENCE, m.ReferenceRequest(lead=0.05)).goal_id is None
    stack.step_to(stack.ticks(canceled.stop_time) + 1)
    assert stack.result(accepted.goal_id).outcome == "canceled"


def test_polynomials_that_leave_the_limits_move_nothing(stack: Stack):
    """The refusal names the limit and the joint."""
    made = motion()
    made.breaks[:] /= 10
    made.coefficients[:] *= 10.0 ** np.arange(6)
    with pytest.raises(Refusal) as caught:
        execute(stack, made, count=81, hit_index=40)
    assert (caught.value.code, caught.value.detail["joint"]) == ("limit", "joint_1")
    stack.step(100)
    assert not Reference(stack.commands()).velocities.any()


def test_what_is_put_instead_of_asked_is_logged(stack: Stack):
    """The owner of the request logs what to do instead; nothing moves."""
    for key, owner in (("goal", "planner"), ("execute", "controller"), ("sim/reset", "sim")):
        log = stack.folder / f"{owner}.log"
        body = b"\x80"
        stack.bus.session.put(stack.bus.key(key), body, congestion_control=zenoh.CongestionControl.BLOCK)
        said = f"something was put on {stack.bus.key(key)} and did nothing; send a request as a query: get, not put"
        wait_for(lambda log=log, said=said: said in log.read_text(), f"{owner} to log what was put")
    stack.step(20)
    assert not Reference(stack.commands()).velocities.any()


def test_a_json_body_is_recognised(stack: Stack):
    """The refusal to a bare client says that its body looks like JSON."""
    (reply,) = stack.bus.session.get(stack.bus.key("goal"), payload=b'{"primitive": "forehand"}', timeout=PATIENCE_S)
    assert reply.err is not None
    assert b"looks like JSON" in reply.err.payload.to_bytes()
