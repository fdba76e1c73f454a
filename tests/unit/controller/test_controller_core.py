"""The controller without its bus, against an arm that follows every command exactly."""

import dataclasses

import msgspec
import numpy as np
import pytest
from msgspec import UNSET, UnsetType

from protocol import messages as m
from protocol.codec import matrix, matrix_bytes
from protocol.errors import Refusal
from robot.schema import Tolerance
from services.controller.core import Controller
from services.controller.incidents import touch_of
from services.controller.modes import Mode
from tests.golden.examples import EXAMPLES
from tests.unit.controller.perfect_arm import JOINTS, ROBOT, TICK, PerfectArm, execute, refused, trajectory


@pytest.fixture
def arm() -> PerfectArm:
    """Return an arm whose first ten states have been answered."""
    arm = PerfectArm(Controller(ROBOT))
    arm.turn(10)
    return arm


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


def test_a_state_that_is_old_doubled_or_malformed_gets_no_answer(arm: PerfectArm):
    """The loop counts such a state."""
    answer = arm.controller.answer
    for state in (arm.state(tick=9), arm.state(tick=3), arm.state(positions=[0.0]), arm.state(velocities=[0.0] * 7)):
        assert answer(state, 0) is None
    assert answer(arm.state(), 0) is not None


def test_tick_0_of_the_same_run_begins_a_new_run_in_stepped_time(arm: PerfectArm):
    """In stepped time the seed is the run's number, and a seed may be repeated."""
    arm.controller.states.stepped = True
    execute(arm, trajectory(arm.controller, 30))
    arm.turn(100)
    pose = (ROBOT.home + 0.1).tolist()
    command = arm.controller.answer(arm.state(tick=0, positions=pose, velocities=[0.0] * JOINTS), 0)
    assert command is not None
    assert command.positions == pose
    assert arm.controller.ledger.result("goal").outcome == "aborted"
    assert arm.controller.mode is Mode.HOLDING


@pytest.mark.parametrize("tick", [0, -5])
def test_in_real_time_an_old_tick_begins_no_run(arm: PerfectArm, tick: int):
    """A replayed state would otherwise move the reference back to where the arm was then."""
    execute(arm, trajectory(arm.controller, 30))
    arm.turn(100)
    assert arm.controller.answer(arm.state(tick=tick), 0) is None
    assert arm.controller.mode is Mode.TRACKING


def test_a_truth_that_does_not_fit_the_arm_is_refused(arm: PerfectArm):
    """The truth is compared with the reference at the hit, so it needs an entry for every joint."""
    for positions, velocities in (([], []), ([0.0] * JOINTS, [0.0])):
        truth = m.Point(positions=positions, velocities=velocities)
        assert arm.controller.answer(arm.state(truth=truth), 0) is None


def test_a_brake_that_does_not_let_go_is_a_fault_again(arm: PerfectArm):
    """Noise may keep the brake on; no goal may run while the arm brakes."""
    controller = arm.controller
    arm.brake = True
    arm.turn(1)
    controller.reset()
    arm.turn(ROBOT.silence_ticks)
    assert controller.mode is Mode.HOLDING
    arm.turn(1)
    assert controller.mode is Mode.FAULT
    assert "still brakes" in (controller.fault or "")


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
    execute(arm, trajectory(controller, 30, client_id="alice", lease=True))
    arm.turn(10)
    execute(arm, trajectory(controller, 30, "follow-up", client_id="alice"))
    arm.clients.discard("alice")
    controller.end_lease("alice")
    assert controller.mode is Mode.STOPPING
    arm.turn(300)
    assert [controller.ledger.result(name).outcome for name in ("goal", "follow-up")] == ["canceled", "canceled"]
    assert all(command.positions == ROBOT.home.tolist() for command in arm.commands)


def test_a_large_tracking_error_is_a_fault(arm: PerfectArm):
    """The arm stops, the goal is aborted, and the fault lasts until a reset at rest."""
    controller = arm.controller
    execute(arm, trajectory(controller, 30))
    arm.turn(40)
    pushed = arm.positions.copy()
    pushed[2] += ROBOT.max_tracking_error + 0.01
    controller.answer(arm.state(positions=pushed.tolist()), 0)
    arm.tick += 1
    assert controller.mode is Mode.FAULT
    assert "joint_3" in (controller.fault or "")
    assert controller.ledger.result("goal").outcome == "aborted"
    assert refused(arm, trajectory(controller, arm.tick + 5, "next")).code == "fault"
    with pytest.raises(Refusal) as caught:
        controller.reset()
    assert caught.value.code == "busy"
    arm.turn(600)
    assert controller.mode is Mode.FAULT
    assert controller.reset() == m.ModeReply(mode="holding")
    assert controller.fault is None
    assert controller.reference(m.ReferenceRequest(lead=0.0)).positions == pytest.approx(arm.positions, abs=1e-3)


def test_a_braking_arm_is_a_fault(arm: PerfectArm):
    """It is one at the controller's start too, and once per braking: after a reset it is not repeated."""
    for controller in (arm.controller, Controller(ROBOT)):
        controller.answer(arm.state(brake=True), 0)
        assert controller.mode is Mode.FAULT
        controller.reset()
        assert controller.answer(arm.state(brake=True, tick=arm.tick + 1), 0) is not None
        assert controller.mode is Mode.HOLDING
        controller.answer(arm.state(brake=False, tick=arm.tick + 2), 0)
        controller.answer(arm.state(brake=True, tick=arm.tick + 3), 0)
        assert controller.mode is Mode.FAULT
        controller.answer(arm.state(brake=True, run=2, tick=0), 0)
        assert controller.mode is Mode.FAULT


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


@pytest.mark.parametrize(
    ("condition", "words"),
    [
        ("braking", "the arm braked by itself"),
        ("reflex", "the arm stopped itself in a reflex"),
        ("user_stopped", "the arm was stopped by its user"),
        ("guiding", "the arm is guided by hand"),
        ("not_ready", "the arm is not ready"),
    ],
)
def test_an_arm_that_follows_no_commands_is_a_fault(arm: PerfectArm, condition: m.Condition, words: str):
    """The fault quotes its reason; goals are refused with it, after a reset too, until the arm is ready."""
    execute(arm, trajectory(arm.controller, 30))
    arm.turn(50)
    assert arm.controller.answer(arm.state(condition=condition, reason="joint_2 says so"), 0) is not None
    assert arm.controller.fault == f"{words}: joint_2 says so"
    assert arm.controller.ledger.result("goal").outcome == "aborted"
    arm.tick += 1
    arm.velocities[:] = 0.0
    assert arm.controller.answer(arm.state(condition=condition, reason="joint_2 says so"), 0) is not None
    cure = "`reset`" if condition == "braking" else "`recover`"
    assert cure in refused(arm, trajectory(arm.controller, 200, "meanwhile")).message
    if condition == "braking":
        assert arm.controller.reset().mode == "holding"
    else:
        with pytest.raises(Refusal) as caught:
            arm.controller.reset()
        assert caught.value.code == "fault"
        assert "`recover`" in caught.value.message
    refusal = refused(arm, trajectory(arm.controller, 200, "another"))
    assert (refusal.code, refusal.detail["fault"]) == ("fault", f"{words}: joint_2 says so")
    arm.run, arm.tick = 2, 0
    arm.turn(10)
    execute(arm, trajectory(arm.controller, 30, "after"))


def test_an_older_robot_side_reports_only_its_brake(arm: PerfectArm):
    """This is taken as the condition "braking" without a reason."""
    arm.brake = True
    arm.turn(1)
    assert arm.controller.fault == "the arm braked by itself"


@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_the_reference_gives_way_to_an_arm_that_is_kept_from_it(arm: PerfectArm, speed: float):
    """It restarts where the arm is, stops inside the limits, and does so again while the arm is pushed."""
    controller = arm.controller
    execute(arm, trajectory(controller, 30))
    arm.turn(40)
    for _ in range(2):
        arm.positions[2] += ROBOT.max_tracking_error + 0.01
        arm.velocities[2] = speed
        measured = arm.state()
        arm.turn(1)
        command = arm.commands[-1]
        assert (command.positions, command.velocities) == (measured.positions, measured.velocities)
        began = len(arm.commands)
        arm.turn(400)
        velocities = np.array([command.velocities for command in arm.commands[began - 1 :]])
        accelerations = np.diff(velocities, axis=0) / TICK
        assert not velocities[-1].any()
        assert np.all(np.abs(accelerations) <= ROBOT.limits.accelerations + 1e-9)
        assert np.all(np.abs(np.diff(accelerations, axis=0)) / TICK <= ROBOT.limits.jerks + 1e-6)


def test_with_on_fault_stop_the_reference_ends_its_own_way():
    config = dataclasses.replace(ROBOT, on_fault="stop")
    arm = PerfectArm(Controller(config))
    arm.turn(10)
    arm.positions[2] += config.max_tracking_error + 0.01
    arm.turn(1)
    assert arm.controller.fault
    assert arm.commands[-1].positions == ROBOT.home.tolist()


@pytest.mark.parametrize(
    ("bodies", "touch"),
    [
        (["racket", "ball"], m.FirstContact(body="racket", other="ball", time=0.05)),
        (["floor", "racket"], m.FirstContact(body="racket", other="floor", time=0.05)),
        (["forearm", "shoulder"], m.FirstContact(body="forearm", other="shoulder", time=0.05)),
        (["floor", "ball"], None),
        (["racket"], None),
    ],
)
def test_contacts_are_assigned_to_the_arm(bodies: list[str], touch: m.FirstContact | None):
    assert touch_of(m.Contact(time=0.05, bodies=bodies, impulse=1.0, ball_velocity=None), ROBOT) == touch


def test_a_result_has_the_first_touch_and_the_clipped_ticks(arm: PerfectArm):
    """Touches before the motion began do not count."""
    execute(arm, trajectory(arm.controller, 30))
    ledger = arm.controller.ledger
    ledger.note_touch(m.FirstContact(body="racket", other="floor", time=0.02), 20)
    arm.turn(100)
    for name in ("ball", "post"):
        ledger.note_touch(m.FirstContact(body="racket", other=name, time=0.05), 50)
    for _ in range(3):
        arm.controller.answer(arm.state(saturated=[True] + [False] * (JOINTS - 1)), 0)
        arm.tick += 1
    result = ledger.result("goal")
    assert result.first_contact == m.FirstContact(body="racket", other="ball", time=0.05)
    assert result.saturated_ticks == 3


@pytest.mark.parametrize(
    ("robot", "goal", "outcome"),
    [
        (Tolerance(), UNSET, "succeeded"),
        (Tolerance(positions=0.01), UNSET, "missed"),
        (Tolerance(positions=0.01), m.Tolerance(positions=0.1), "succeeded"),
        (Tolerance(positions=0.01), m.Tolerance(velocities=1.0), "missed"),
        (Tolerance(), m.Tolerance(velocities=0.01), "missed"),
    ],
)
def test_a_hit_outside_its_tolerance_is_missed(robot: Tolerance, goal: m.Tolerance | UnsetType, outcome: m.Outcome):
    """The tolerance is the goal's or, if that is null, the robot's."""
    arm = PerfectArm(Controller(dataclasses.replace(ROBOT, tolerance=robot)))
    arm.turn(10)
    execute(arm, trajectory(arm.controller, 30, tolerance=goal))
    arm.turn(220)
    arm.positions[1] += 0.05
    arm.velocities[1] += 0.05
    arm.turn(400)
    result = arm.controller.ledger.result("goal")
    assert result.outcome == outcome
    assert ("joint_2 was" in result.reason) == (outcome == "missed")
