"""The controller without its bus, against an arm that follows every command exactly."""

import msgspec
import pytest

from protocol import messages as m
from protocol.codec import matrix, matrix_bytes
from protocol.errors import Refusal
from services.controller.core import Controller
from services.controller.modes import Mode
from tests.golden.examples import EXAMPLES
from tests.unit.controller.perfect_arm import JOINTS, ROBOT, TICK, PerfectArm, execute, refused, trajectory


def test_a_trajectory_is_played_to_rest(arm: PerfectArm):
    """The commands are its samples, the hit is noted at its tick, and each stamp is set."""
    accepted = execute(arm, trajectory(arm.controller, 30))
    assert accepted == m.Accepted(goal_id="goal", start_time=0.03)
    assert arm.controller.mode is Mode.TRACKING
    arm.turn(500)
    result = arm.controller.ledger.result("goal")
    assert result.outcome == "succeeded"
    assert result.hit is not None
    assert result.hit.time == pytest.approx(0.230)
    assert max(map(abs, result.hit.position_error)) < 1e-6
    assert result.stamps == m.Stamps(requested=1, planned=2, accepted=3, first_command=30)
    assert arm.controller.mode is Mode.HOLDING
    assert arm.commands[29].goal_id is None
    assert arm.commands[30].goal_id == "goal"
    assert arm.commands[-1].goal_id is None
    assert 0 < result.peak_tracking_error < 1e-4


def test_before_the_first_state_requests_are_refused():
    """Every request is refused as unavailable; the refusal names the sim."""
    controller = Controller(ROBOT)
    assert controller.states.newest is None
    for ask in (
        lambda: controller.cancel(m.Cancel()),
        lambda: controller.reference(m.ReferenceRequest(lead=0.0)),
        controller.status,
        controller.reset,
    ):
        with pytest.raises(Refusal) as caught:
            ask()
        assert (caught.value.code, caught.value.detail["service"]) == ("unavailable", "sim")


def test_the_reference_is_asked_for_ahead(arm: PerfectArm):
    """The reply is for the first tick at or after now + lead, and includes motions that were accepted."""
    asked = arm.controller.reference(m.ReferenceRequest(lead=0.0201))
    assert asked.time == pytest.approx(9 * TICK + 0.021)
    assert asked.positions == ROBOT.home.tolist()
    assert arm.controller.reference(m.ReferenceRequest(lead=0.0)).time == pytest.approx(10 * TICK)
    execute(arm, trajectory(arm.controller, 30))
    later = arm.controller.reference(m.ReferenceRequest(lead=0.2))
    assert later.velocities[0] > 1.0
    assert later.epoch == asked.epoch + 1
    assert (asked.goal_id, later.goal_id) == (None, "goal")
    assert arm.controller.reference(m.ReferenceRequest(lead=1.0)).goal_id is None
    arm.controller.cancel(m.Cancel())
    assert arm.controller.reference(m.ReferenceRequest(lead=0.05)).goal_id is None


def test_trajectories_that_must_not_move_the_arm_are_refused(arm: PerfectArm):
    """Refuse what is late, superseded by a plan or a cancel, discontinuous, or a duplicate."""
    controller = arm.controller
    assert refused(arm, trajectory(controller, 9)).code == "late"
    elsewhere = trajectory(controller, 30)
    positions = matrix(elsewhere.positions, elsewhere.count, JOINTS, "positions")
    elsewhere.positions = matrix_bytes(positions + 1e-5)
    jump = refused(arm, elsewhere)
    assert (jump.code, jump.detail["field"]) == ("invalid_goal", "positions")
    stale = trajectory(controller, 30)
    controller.cancel(m.Cancel())
    refusal = refused(arm, stale)
    assert (refusal.code, refusal.detail["cause"]) == ("superseded", "break")
    early, overtaken = trajectory(controller, 30), trajectory(controller, 30, "other")
    execute(arm, early)
    refusal = refused(arm, overtaken)
    assert (refusal.code, refusal.detail["cause"]) == ("superseded", "plan")
    assert refused(arm, trajectory(controller, 30)).code == "duplicate"
    assert refused(arm, trajectory(controller, 30, "polite", preempt=False)).code == "busy"


def test_motions_that_wait_are_bounded(arm: PerfectArm, monkeypatch: pytest.MonkeyPatch):
    """A client that never stops sending does not take all memory; once motions were played, others are accepted."""
    controller = arm.controller
    first = trajectory(controller, 30)
    monkeypatch.setattr("services.controller.ledger.MOST_SAMPLES", 2 * first.count + 1)
    execute(arm, first)
    execute(arm, trajectory(controller, 1030, "second"))
    refusal = refused(arm, trajectory(controller, 2030, "third"))
    assert (refusal.code, refusal.detail["goal_id"]) == ("busy", "second")
    execute(arm, trajectory(controller, 1020, "instead"))
    arm.turn(1100)
    execute(arm, trajectory(controller, 2030, "third"))


def test_a_cancel_that_names_a_goal_in_flight_supersedes_its_plan(arm: PerfectArm):
    """The goal is still unknown; when its plan arrives it must not move the arm."""
    flying = trajectory(arm.controller, 30)
    with pytest.raises(Refusal) as caught:
        arm.controller.cancel(m.Cancel(goal_id="goal"))
    assert caught.value.code == "unknown_goal"
    assert refused(arm, flying).code == "superseded"


def test_a_cancel_of_a_goal_that_is_over_stops_nothing(arm: PerfectArm):
    """The motion under way goes on."""
    execute(arm, trajectory(arm.controller, 30))
    arm.turn(500)
    execute(arm, trajectory(arm.controller, arm.tick + 5, "next"))
    assert arm.controller.cancel(m.Cancel(goal_id="goal")).goal_id is None
    arm.turn(10)
    assert arm.controller.mode is Mode.TRACKING


def test_the_epoch_rises_with_everything_that_changes_the_future(arm: PerfectArm):
    """It rises at an accept, a cancel, a fault and a reset."""
    controller = arm.controller
    epochs = [controller.epoch]
    execute(arm, trajectory(controller, 30))
    epochs.append(controller.epoch)
    controller.cancel(m.Cancel())
    epochs.append(controller.epoch)
    controller.raise_fault("test")
    epochs.append(controller.epoch)
    arm.turn(100)
    controller.reset()
    epochs.append(controller.epoch)
    assert epochs == sorted(set(epochs))


def test_the_status_has_the_tracking_error(arm: PerfectArm):
    """The status has measured minus reference, and the time since the goal's start."""
    execute(arm, trajectory(arm.controller, 30))
    arm.turn(50)
    off = arm.positions + 0.001
    arm.controller.answer(arm.state(positions=off.tolist()), 0)
    status = arm.controller.status()
    assert status.goal_id == "goal"
    assert status.time_from_start == pytest.approx(0.030)
    assert status.error.positions == pytest.approx([0.001] * JOINTS, abs=1e-6)
    assert status.mode == "tracking"


def described(delay: int) -> m.Description:
    """Return the description of an arm in real time that applies commands `delay` ticks late."""
    description = EXAMPLES["Description"]
    assert isinstance(description, m.Description)
    return msgspec.structs.replace(description, clock="realtime", delay_ticks=delay)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_command_has_the_reference_at_the_end_of_its_tick(arm: PerfectArm, delay: int):
    """It is the tick in which the arm applies it; `accelerations` adds the feedback of eq. 11, here zero."""
    arm.controller.meet(described(delay))
    message = trajectory(arm.controller, 30)
    execute(arm, message)
    arm.turn(100)
    positions = matrix(message.positions, message.count, JOINTS, "positions")
    velocities = matrix(message.velocities, message.count, JOINTS, "velocities")
    for command in arm.commands[30:]:
        k = command.tick - 30 + delay
        assert command.next == m.Point(positions=positions[k + 1].tolist(), velocities=velocities[k + 1].tolist())
        assert command.feedforward == pytest.approx((velocities[k + 1] - velocities[k]) / TICK, abs=1e-12)
        if not delay:
            assert command.accelerations == pytest.approx(command.feedforward, abs=2e-3)


def test_commands_applied_with_the_known_delay_are_in_time(arm: PerfectArm):
    """A command that answers tick k may be applied as late as tick k + delay."""
    arm.controller.meet(described(1))
    missed = arm.controller.status().cycle.missed
    for lag, more in ((1, 0), (2, 0), (3, 1)):
        assert arm.controller.answer(arm.state(applied_tick=arm.tick - lag), 0) is not None
        arm.tick += 1
        assert arm.controller.status().cycle.missed == missed + more
