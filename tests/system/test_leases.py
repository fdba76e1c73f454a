"""Leases: others are kept out until the client that holds one is gone."""

from harness import Reference, Stack, wait_for
from strike_requests import HOME, step_into, strike

from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session


def hold(client: Bus, name: str) -> None:
    """Declare a client's token and wait until the router knows it: the goal is sent by another session."""
    client.announce(f"client/{name}")
    assert client.is_alive(f"client/{name}")


def test_a_lease_keeps_others_out_and_ends_with_its_client(stack: Stack):
    """Goals of others are refused as `not_holder`; when the holder's session closes, the motion is canceled."""
    with Bus(open_session([stack.endpoint])) as client:
        hold(client, "alice")
        first = strike(stack, client_id="alice", lease=True)
        step_into(stack, first, 2)
        refusal = stack.refused_goal(primitive="forehand", positions=HOME, client_id="bob")
        assert (refusal.code, refusal.detail["client_id"]) == ("not_holder", "alice")
        assert stack.refused_goal(primitive="forehand", positions=HOME).code == "not_holder"
        second = strike(stack, client_id="alice", lease=True)
        step_into(stack, second, 2)
        assert stack.status().mode == "tracking"
    wait_for(lambda: stack.status().mode == "stopping", "the controller to detect that the client is gone")
    stack.step(300)
    result = stack.result(second.goal_id)
    assert result.outcome == "canceled"
    assert "alice" in result.reason
    assert stack.result(first.goal_id).outcome == "preempted"
    Reference(stack.commands()).check_smooth()
    third = stack.goal(primitive="forehand", positions=HOME, client_id="bob")
    assert stack.finish(third).outcome == "succeeded"


def test_a_lease_needs_a_client_that_lives(stack: Stack):
    """A client without a token gets no lease, because nothing would ever end it."""
    refusal = stack.refused_goal(primitive="forehand", positions=HOME, client_id="ghost", lease=True)
    assert (refusal.code, refusal.detail["client_id"]) == ("not_holder", "ghost")
    stack.step(100)
    assert not Reference(stack.commands()).velocities.any()


def test_anyone_may_cancel_a_leased_motion(stack: Stack):
    """A cancel needs no lease."""
    with Bus(open_session([stack.endpoint])) as client:
        hold(client, "carol")
        reply = strike(stack, client_id="carol", lease=True)
        step_into(stack, reply, 3)
        assert stack.cancel(reply.goal_id).goal_id == reply.goal_id
