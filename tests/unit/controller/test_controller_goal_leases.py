"""Leases: who may move the arm while a client holds one, and when it ends."""

from services.controller.modes import Mode
from tests.unit.controller.perfect_arm import PerfectArm, execute, refused, trajectory


def test_leases(arm: PerfectArm):
    """Only a client that is alive gets a lease; it keeps others out; when the client is gone the motion is canceled."""
    controller = arm.controller
    leased = trajectory(controller, 30, client_id="alice", lease=True)
    assert refused(arm, leased).code == "not_holder"
    arm.clients.add("alice")
    execute(arm, leased)
    arm.turn(50)
    refusal = refused(arm, trajectory(controller, arm.tick + 5, "b", client_id="bob"))
    assert (refusal.code, refusal.detail["client_id"]) == ("not_holder", "alice")
    controller.end_lease("bob")
    assert controller.mode is Mode.TRACKING
    arm.clients.discard("alice")
    controller.end_lease("alice")
    assert controller.mode is Mode.STOPPING
    arm.turn(300)
    assert controller.ledger.result("goal").outcome == "canceled"
    assert refused(arm, trajectory(controller, arm.tick + 5, "c", client_id="alice", lease=True)).code == "not_holder"
    execute(arm, trajectory(controller, arm.tick + 5, "d", client_id="bob"))


def test_a_lease_counts_until_its_goal_is_over(arm: PerfectArm):
    """It counts even if the same client's next goal, without a lease, is accepted."""
    controller = arm.controller
    arm.clients.add("alice")
    first = trajectory(controller, 30, client_id="alice", lease=True)
    execute(arm, first)
    arm.turn(100)
    execute(arm, trajectory(controller, 30 + first.count, "follow-up", client_id="alice"))
    arm.clients.discard("alice")
    controller.end_lease("alice")
    assert controller.mode is Mode.STOPPING
    arm.turn(300)
    assert [controller.ledger.result(name).outcome for name in ("goal", "follow-up")] == ["canceled", "canceled"]
    assert not any(arm.commands[-1].velocities)
