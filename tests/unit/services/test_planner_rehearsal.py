"""What the planner does before the first goal."""

from services.planner.__main__ import SHIPPED
from services.planner.learning import learn_from_csv
from services.planner.rehearsal import rehearse
from services.robot import load_robot


def test_limits_shape_the_rehearsal():
    """Else the solver would meet its first program with the first goal."""
    robot = load_robot()
    primitive = learn_from_csv(SHIPPED / "forehand.csv", robot.joint_names)
    assert primitive is not None
    made = rehearse(primitive, robot)
    assert {active.joint for active in made.report.active} == set(range(robot.joint_count))
    assert made.total_duration > made.duration
