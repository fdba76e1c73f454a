"""The planner's warm-up before the first goal."""

from robot.description import load_robot
from robot.shipped import DEMONSTRATIONS
from services.planner.learning import learn_from_csv
from services.planner.warm_up import warm_up


def test_the_warm_up_plan_has_active_limits_in_every_joint():
    """Otherwise the solver would run for the first time with the first goal."""
    robot = load_robot()
    primitive = learn_from_csv(DEMONSTRATIONS / "forehand.csv", robot.joint_names)
    assert primitive is not None
    made = warm_up(primitive, robot)
    assert {active.joint for active in made.report.active} == set(range(robot.joint_count))
    assert made.total_duration > made.duration
