"""Where a correction begins, without a question to the controller."""

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
"""Robot time over wall time."""


@dataclass
class Swing:
    """An arm that plays a motion of the planner, and what the planner foresees; the wall clock is twice as fast."""

    loop: ClosedLoop
    foresight: Foresight
    played: Plan
    wall: list[float] = field(default_factory=lambda: [100.0])

    def turn(self, ticks: int) -> None:
        """Let time pass; the planner receives a status every 20 ticks, at once."""
        for tick in range(ticks):
            self.loop.turn(1)
            self.wall[0] += ROBOT.tick / PACE
            if tick % 20 == 19:
                self.foresight.receive(self.loop.controller.status())

    def both(self, lead: float) -> tuple[m.Reference | None, m.Reference]:
        """What is foreseen, and what the controller says at the same time."""
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


def test_it_is_what_the_controller_says(swing: Swing):
    swing.turn(210)
    for lead in (0.0, 0.0123, 0.2):
        foreseen, said = swing.both(lead)
        assert foreseen is not None
        assert (foreseen.time, foreseen.epoch, foreseen.goal_id) == (pytest.approx(said.time), said.epoch, "g1")
        for name in ("positions", "velocities", "accelerations"):
            assert getattr(foreseen, name) == pytest.approx(getattr(said, name), abs=1e-9), name
        assert max(map(abs, foreseen.velocities)) > 0.01


def test_a_status_that_is_taken_in_late_does_not_matter(swing: Swing):
    swing.turn(200)
    late = swing.loop.controller.status()
    swing.loop.turn(5)
    swing.wall[0] += 5 * ROBOT.tick / PACE
    swing.foresight.receive(late)
    foreseen, said = swing.both(0.01)
    assert foreseen is not None
    assert foreseen.time == pytest.approx(said.time, abs=1.1 * ROBOT.tick)


def test_the_pace_is_that_of_the_robot(swing: Swing):
    assert swing.foresight.pace is None
    swing.turn(100)
    assert swing.foresight.pace == pytest.approx(PACE)


def test_what_only_the_controller_knows(swing: Swing):
    assert swing.foresight.reference(0.01) is None  # nothing was received
    swing.turn(100)
    assert swing.foresight.reference(0.01) is not None
    assert swing.foresight.reference(5.0) is None  # after the end
    swing.wall[0] += 0.2
    assert swing.foresight.reference(0.01) is None  # the controller is silent
    swing.turn(100)
    assert swing.foresight.reference(0.01) is not None
    swing.loop.controller.cancel(m.Cancel())
    swing.foresight.receive(swing.loop.controller.status())
    assert swing.foresight.reference(0.01) is None  # another epoch


def test_a_motion_that_has_not_begun(swing: Swing):
    swing.foresight.note("g2", swing.loop.controller.status().time + 0.3, 1, swing.played)
    swing.turn(100)
    assert swing.foresight.reference(0.01) is None


def test_a_correction_that_was_foreseen_in_an_old_epoch_moves_nothing(swing: Swing):
    swing.turn(100)
    foreseen = swing.foresight.reference(0.02)
    assert foreseen is not None
    swing.loop.controller.cancel(m.Cancel())
    stale = m.Trajectory(
        goal_id="g2",
        epoch=foreseen.epoch,
        joint_names=list(ROBOT.joint_names),
        start_time=foreseen.time,
        dt=ROBOT.tick,
        count=1,
        hit_index=0,
        positions=np.array(foreseen.positions).tobytes(),
        velocities=REST.tobytes(),
        accelerations=REST.tobytes(),
    )
    with pytest.raises(Refusal, match="planned in epoch") as refused:
        swing.loop.controller.execute(check_trajectory(stale, ROBOT), (), now_ns=0)
    assert refused.value.code == "superseded"


def test_another_controller_plays_nothing_of_this_planner(swing: Swing):
    """Its epochs begin again, so that one of them may be that of the motion."""
    swing.turn(110)
    assert swing.foresight.reference(0.02) is not None
    status = swing.loop.controller.status()
    swing.foresight.receive(msgspec.structs.replace(status, epoch=status.epoch - 1))
    swing.foresight.receive(status)
    assert swing.foresight.reference(0.02) is None
