"""Goals in tool space, through the planner's solver, on arms of other people."""

from dataclasses import dataclass
from typing import Any

import msgspec
import mujoco
import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.primitive import Primitive, learn
from motion.request import Boundary
from protocol import messages as m
from protocol.errors import Refusal
from robot.description import RobotConfig, load_robot
from robot.kinematics import Kinematics
from services.planner.corrections import Correction
from services.planner.goal_checks import check_goal
from services.planner.goals import Origin
from services.planner.solving import Made, Solver
from tests import arms

ARMS = {"ur5e": arms.UR5E, "panda": arms.PANDA, "iiwa14": arms.IIWA14, "so101": arms.SO101}
ASIDE = np.array([0.01, 0.0, -0.01])


@dataclass(frozen=True)
class Lab:
    """An arm with a planner's solver, and with kinematics of its own to judge plans by."""

    name: str
    config: RobotConfig
    solver: Solver
    judge: Kinematics
    primitive: Primitive

    def solved(self, correction: Correction | None = None, **fields: object) -> Made:
        """Plan a goal of 2 s from home at rest, or a correction of a motion there."""
        joints = self.config.joint_count
        goal = m.Goal(**{"primitive": "wave", "duration": 2.0, "plan_only": True, **fields})  # type: ignore[arg-type]
        check_goal(goal, self.primitive, self.config)
        origin = Origin(0.0, 0, Boundary(self.config.home, np.zeros(joints), np.zeros(joints)), correction)
        with pytest.raises(StopIteration) as done:
            next(self.solver.solve(goal, self.primitive, origin))
        return done.value.value

    def reached(self, *moved: float) -> tuple[np.ndarray, np.ndarray]:
        """Where the tool is (3,), and how it is turned (3, 3), with the joints moved away from home."""
        return self.judge.tool_pose(self.config.home + np.resize(moved, self.config.joint_count))

    def end(self, made: Made) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, rotation and velocity of the tool at the end of a plan."""
        end = made.plan.request.goal
        return *self.judge.tool_pose(end.positions), self.judge.tool_velocity(end.positions, end.velocities)


@pytest.fixture(scope="module", params=ARMS)
def lab(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Lab:
    """Each of the arms."""
    config = load_robot(ARMS[request.param].write(tmp_path_factory.mktemp("robot")))
    times = np.linspace(0, 1, 101)
    shape = 3 * times**2 - 2 * times**3
    movement = config.home + np.outer(shape, np.resize([0.4, -0.3], config.joint_count))
    primitive = learn(Demonstration(2 * times, movement))
    return Lab(request.param, config, Solver(config), Kinematics(config), primitive)


def test_the_tool_is_where_it_should_be_and_moves_so(lab: Lab):
    position, rotation = lab.reached(0.3, -0.2, 0.25)
    velocity = 0.15 * rotation[:, 0]
    tool = m.ToolGoal(position=tuple(position), axis=tuple(rotation[:, 2]), velocity=tuple(velocity))
    made = lab.solved(tool=tool)
    at, turned, moves = lab.end(made)
    assert np.abs(at - position).max() < 1e-8
    assert turned[:, 2] == pytest.approx(rotation[:, 2], abs=1e-8)
    assert moves == pytest.approx(velocity, abs=1e-8)
    assert made.plan.report.certified
    assert made.alternative == 0


def test_a_whole_orientation_with_its_turning(lab: Lab):
    position, rotation = lab.reached(0.3, -0.2, 0.25)
    quaternion: Any = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, rotation.flatten())
    if lab.config.joint_count == 5:
        aside = m.ToolGoal(position=tuple(position), orientation=tuple(quaternion + np.array([0, 0.2, -0.3, 0.1])))
        assert refused(lab, tool=aside).detail["reason"] == "orientation"
        return
    tool = m.ToolGoal(
        position=tuple(position),
        orientation=tuple(3 * quaternion),
        velocity=(0.05, 0.0, 0.1),
        angular_velocity=(0.0, 0.2, 0.0),
    )
    made = lab.solved(tool=tool)
    at, turned, moves = lab.end(made)
    assert np.abs(at - position).max() < 1e-8
    assert turned == pytest.approx(rotation, abs=1e-8)
    assert moves == pytest.approx([0.05, 0.0, 0.1], abs=1e-8)
    nudge = 1e-6 * made.plan.request.goal.velocities
    _, later = lab.judge.tool_pose(made.plan.request.goal.positions + nudge)
    turning = (later - turned) @ turned.T / 1e-6
    assert [turning[2, 1], turning[0, 2], turning[1, 0]] == pytest.approx([0.0, 0.2, 0.0], abs=1e-5)


def test_the_posture_that_imitates_best_is_played(lab: Lab):
    """Where the demonstration itself ends in the pose, its own posture is found."""
    wanted = lab.config.home + np.resize([0.4, -0.3], lab.config.joint_count)
    position, rotation = lab.judge.tool_pose(wanted)
    made = lab.solved(tool=m.ToolGoal(position=tuple(position), axis=tuple(rotation[:, 2])))
    assert made.plan.request.goal.positions == pytest.approx(wanted, abs=1e-5)
    assert made.plan.request.goal.velocities == pytest.approx(np.zeros(lab.config.joint_count))


def test_it_comes_back_the_same(lab: Lab):
    position, _ = lab.reached(0.2, 0.1)
    first, again = (lab.solved(tool=m.ToolGoal(position=tuple(position))) for _ in range(2))
    assert np.array_equal(first.plan.request.goal.positions, again.plan.request.goal.positions)


def test_a_waypoint_of_the_tool(lab: Lab):
    position, rotation = lab.reached(0.15, -0.1, 0.2)
    tool = m.ToolGoal(position=tuple(position), axis=tuple(rotation[:, 2]), velocity=(0.05, 0.0, 0.02))
    joints = m.Waypoint(time_from_start=1.5, velocities=[0.1, *[None] * (lab.config.joint_count - 1)])
    made = lab.solved(waypoints=[joints, m.Waypoint(time_from_start=0.9, tool=tool)], duration=2.0)
    through = next(w for w in made.plan.request.waypoints if w.time_from_start == 0.9)
    at, turned = lab.judge.tool_pose(through.positions)
    assert at == pytest.approx(position, abs=1e-8)
    assert turned[:, 2] == pytest.approx(rotation[:, 2], abs=1e-8)
    assert lab.judge.tool_velocity(through.positions, through.velocities) == pytest.approx([0.05, 0, 0.02], abs=1e-8)


def test_a_correction_keeps_to_its_posture(lab: Lab):
    """Though another one may be nearer to what would be imitated."""
    position, _ = lab.reached(0.3, -0.2, 0.25)
    end = lab.solved(tool=m.ToolGoal(position=tuple(position))).plan.request.goal.positions
    elsewhere = m.ToolGoal(position=tuple(position + ASIDE))
    corrected = lab.solved(Correction(0.2, 2.0, tuple(end)), tool=elsewhere)
    assert np.abs(corrected.plan.request.goal.positions - end).max() < 0.2
    assert lab.end(corrected)[0] == pytest.approx(position + ASIDE, abs=1e-8)


def refused(lab: Lab, **fields: Any) -> Refusal:
    """The refusal of a goal."""
    with pytest.raises(Refusal) as caught:
        lab.solved(**fields)
    return caught.value


def test_of_several_times_the_one_that_imitates_best_is_played(lab: Lab):
    """In whichever posture; the reply says which alternative it was."""
    position, _ = lab.reached(0.2, -0.15)
    tool = m.ToolGoal(position=tuple(position), velocity=(0.1, 0.0, 0.1))
    made = lab.solved(tool=tool, duration=0.9, alternatives=[m.Alternative(duration=t) for t in (1.0, 2.0, 1.1)])
    assert (made.alternative, made.plan.duration) == (2, 2.0)
    assert lab.end(made)[0] == pytest.approx(position, abs=1e-6)
    assert lab.end(made)[2] == pytest.approx([0.1, 0.0, 0.1], abs=1e-6)
    many = [m.Alternative(duration=0.9 + k / 1000) for k in range(256)]
    assert lab.solved(tool=tool, duration=0.5, alternatives=many).alternative > 0


def test_what_cannot_be_reached_names_the_nearest(lab: Lab):
    far = refused(lab, tool=m.ToolGoal(position=(3.0, 0.0, 0.5)))
    assert (far.code, far.detail["reason"]) == ("unreachable", "out of reach")
    nearest = far.detail["nearest"]
    assert np.linalg.norm(np.array(nearest["position"]) - [3.0, 0.0, 0.5]) == pytest.approx(far.detail["distance"])
    near = m.ToolGoal(position=tuple(nearest["position"]), orientation=tuple(nearest["orientation"]))
    assert lab.solved(tool=near, duration=8.0), "the nearest pose can be reached"


def test_a_velocity_beyond_the_joints_names_one_and_what_works(lab: Lab):
    position, _ = lab.reached(0.3, -0.2, 0.25)
    refusal = refused(lab, tool=m.ToolGoal(position=tuple(position), velocity=(0.0, 9.0, 0.0)))
    assert (refusal.code, refusal.detail["reason"]) == ("unreachable", "velocity")
    assert refusal.detail["distance"] < 1e-6
    assert "whose limit is 3 rad/s" in refusal.message
    share = float(refusal.message.rsplit("; ", 1)[1].split()[0])
    works = m.ToolGoal(position=tuple(position), velocity=(0.0, 9.0 * share, 0.0))
    assert lab.solved(tool=works, duration=8.0, checks=m.Checks(collision=False))  # a run-up through itself


def test_joint_ranges_are_told_from_reach(lab: Lab):
    """With the joints held near home the tool cannot be elsewhere."""
    position, _ = lab.reached(0.5, -0.4, 0.3)
    ranges: list[tuple[float, float] | None] = [(value - 0.05, value + 0.05) for value in lab.config.home]
    limits = m.GoalLimits(positions=ranges)
    refusal = refused(lab, tool=m.ToolGoal(position=tuple(position)), limits=limits)
    assert (refusal.code, refusal.detail["reason"]) == ("unreachable", "joint ranges")


@pytest.mark.parametrize(
    ("field", "fields"),
    [
        ("positions", {"tool": {"position": [0.4, 0, 0.4]}, "positions": [0.0] * 6}),
        ("velocities", {"tool": {"position": [0.4, 0, 0.4]}, "velocities": [0.0] * 6}),
        (
            "alternatives[1].velocities",
            {"tool": {"position": [0.4, 0, 0.4]}, "alternatives": [{"duration": 1.0}, {"velocities": [0.0] * 6}]},
        ),
        ("tool.axis", {"tool": {"position": [0.4, 0, 0.4], "axis": [0, 0, 1], "orientation": [1, 0, 0, 0]}}),
        ("tool.axis", {"tool": {"position": [0.4, 0, 0.4], "axis": [0, 0, 0]}}),
        ("tool.orientation", {"tool": {"position": [0.4, 0, 0.4], "orientation": [0, 0, 0, 0]}}),
        ("tool.position", {"tool": {"position": [0.4, 0, 1e300]}}),
        ("tool.velocity", {"tool": {"position": [0.4, 0, 0.4], "velocity": [-1e5, 0, 0]}}),
        (
            "waypoints[0].tool",
            {"waypoints": [{"time_from_start": 0.5, "tool": {"position": [0, 0, 1]}, "positions": [0.0] * 6}]},
        ),
        (
            "waypoints[0].tool.axis",
            {"waypoints": [{"time_from_start": 0.5, "tool": {"position": [0, 0, 1], "axis": [0, 0, 0]}}]},
        ),
    ],
)
def test_what_contradicts_itself(field: str, fields: dict[str, object], forehand: Primitive):
    goal = msgspec.convert({"primitive": "forehand", **fields}, m.Goal)
    with pytest.raises(Refusal) as caught:
        check_goal(goal, forehand, load_robot())
    assert (caught.value.code, caught.value.detail["field"]) == ("invalid_goal", field)
    assert field.split(".")[-1] in caught.value.message


@pytest.fixture(scope="module")
def forehand() -> Primitive:
    """Any primitive of the shipped arm."""
    times = np.linspace(0.0, 1.0, 50)
    return learn(Demonstration(times, np.outer(times, np.ones(6))))
