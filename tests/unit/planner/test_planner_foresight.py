"""Prediction of the reference at which a correction begins, without a request to the controller."""

import time
from dataclasses import dataclass, field

import msgspec
import numpy as np
import pytest

from motion.plan import Plan, plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest
from protocol import messages as m
from protocol.errors import Refusal
from robot.description import load_robot
from robot.shipped import DEMONSTRATIONS
from services.controller.checks import check_trajectory
from services.planner.foresight import Foresight
from services.planner.goals import Origin
from services.planner.learning import learn_from_csv
from services.planner.messages import executed_message
from services.planner.solving import Made
from tests.closed_loop import ClosedLoop

ROBOT = load_robot()
REST = np.zeros(ROBOT.joint_count)
PACE = 0.5
"""Robot time per wall-clock time."""


@dataclass
class Swing:
    """A closed loop that plays a motion of the planner, the planner's prediction, and a fake wall clock."""

    loop: ClosedLoop
    foresight: Foresight
    played: Plan
    wall: list[float] = field(default_factory=lambda: [100.0])

    def turn(self, ticks: int) -> None:
        """Advance the loop and the clock; the planner receives a status every 20 ticks, without delay."""
        for tick in range(ticks):
            self.loop.turn(1)
            self.wall[0] += ROBOT.tick / PACE
            if tick % 20 == 19:
                self.foresight.receive(self.loop.controller.status())

    def both(self, lead: float) -> tuple[m.Reference | None, m.Reference]:
        """Return the predicted reference and the controller's own at the same time."""
        return self.foresight.reference(lead), self.loop.controller.reference(m.ReferenceRequest(lead=lead))


@pytest.fixture(scope="module")
def forehand() -> Primitive:
    primitive = learn_from_csv(DEMONSTRATIONS / "forehand.csv", ROBOT.joint_names)
    assert primitive is not None
    return primitive


@pytest.fixture
def swing(forehand: Primitive, monkeypatch: pytest.MonkeyPatch) -> Swing:
    loop = ClosedLoop(ROBOT)
    here = loop.controller.reference(m.ReferenceRequest(lead=0.02))
    begin, end = Boundary(ROBOT.home, REST, REST), Boundary(ROBOT.home + 0.3, REST, REST)
    made = plan(forehand, MotionRequest(begin, end, 1.2, ROBOT.limits), ROBOT.tick)
    swing = Swing(loop, Foresight(ROBOT), made)
    monkeypatch.setattr(time, "monotonic", lambda: swing.wall[0])
    sent = Made(made, 0, Origin(here.time, here.epoch, begin), 0.0)
    trajectory = executed_message(sent, m.Goal(primitive="forehand"), "g1", ROBOT, m.Stamps())
    loop.controller.execute(check_trajectory(trajectory, ROBOT), (), now_ns=0)
    swing.foresight.note("g1", here.time, here.epoch, made)
    return swing


def test_the_prediction_agrees_with_the_controllers_reference(swing: Swing):
    swing.turn(210)
    for lead in (0.0, 0.0123, 0.2):
        predicted, said = swing.both(lead)
        assert predicted is not None
        assert (predicted.time, predicted.epoch, predicted.goal_id) == (pytest.approx(said.time), said.epoch, "g1")
        for name in ("positions", "velocities", "accelerations"):
            assert getattr(predicted, name) == pytest.approx(getattr(said, name), abs=1e-9), name
        assert max(map(abs, predicted.velocities)) > 0.01


def test_a_status_received_late_does_not_change_the_prediction(swing: Swing):
    swing.turn(200)
    late = swing.loop.controller.status()
    swing.loop.turn(5)
    swing.wall[0] += 5 * ROBOT.tick / PACE
    swing.foresight.receive(late)
    predicted, said = swing.both(0.01)
    assert predicted is not None
    assert predicted.time == pytest.approx(said.time, abs=1.1 * ROBOT.tick)


def test_the_robots_pace_is_estimated(swing: Swing):
    assert swing.foresight.pace is None
    swing.turn(100)
    assert swing.foresight.pace == pytest.approx(PACE)


def test_there_is_no_prediction_without_a_current_status_and_motion(swing: Swing):
    assert swing.foresight.reference(0.01) is None  # no status yet
    swing.turn(100)
    assert swing.foresight.reference(0.01) is not None
    assert swing.foresight.reference(5.0) is None  # after the motion's end
    swing.wall[0] += 0.2
    assert swing.foresight.reference(0.01) is None  # no status for too long
    swing.turn(100)
    assert swing.foresight.reference(0.01) is not None
    swing.loop.controller.cancel(m.Cancel())
    swing.foresight.receive(swing.loop.controller.status())
    assert swing.foresight.reference(0.01) is None  # another epoch


def test_there_is_no_prediction_before_the_motion_begins(swing: Swing):
    swing.foresight.note("g2", swing.loop.controller.status().time + 0.3, 1, swing.played)
    swing.turn(100)
    assert swing.foresight.reference(0.01) is None


def test_a_correction_predicted_in_an_old_epoch_is_refused_by_the_controller(swing: Swing):
    swing.turn(100)
    predicted = swing.foresight.reference(0.02)
    assert predicted is not None
    swing.loop.controller.cancel(m.Cancel())
    stale = m.Trajectory(
        goal_id="g2",
        epoch=predicted.epoch,
        joint_names=list(ROBOT.joint_names),
        start_time=predicted.time,
        dt=ROBOT.tick,
        count=1,
        hit_index=0,
        positions=np.array(predicted.positions).tobytes(),
        velocities=REST.tobytes(),
        accelerations=REST.tobytes(),
    )
    with pytest.raises(Refusal, match="planned in epoch") as refused:
        swing.loop.controller.execute(check_trajectory(stale, ROBOT), (), now_ns=0)
    assert refused.value.code == "superseded"


def test_there_is_no_prediction_after_another_controller_took_over(swing: Swing):
    """Its epochs start again, so one of them can be equal to the motion's."""
    swing.turn(110)
    assert swing.foresight.reference(0.02) is not None
    status = swing.loop.controller.status()
    swing.foresight.receive(msgspec.structs.replace(status, epoch=status.epoch - 1))
    swing.foresight.receive(status)
    assert swing.foresight.reference(0.02) is None
