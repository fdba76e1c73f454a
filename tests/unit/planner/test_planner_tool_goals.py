"""Goals in tool space, solved by the planner's solver for arms of other projects."""

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
class SolverHarness:
    """An arm with the planner's solver, and separate kinematics to check its plans."""

    name: str
    config: RobotConfig
    solver: Solver
    kinematics: Kinematics
    primitive: Primitive

    def solved(self, correction: Correction | None = None, **fields: object) -> Made:
        """Plan a goal of 2 s from rest at home, or a correction that begins there."""
        joints = self.config.joint_count
        goal = m.Goal(**{"primitive": "wave", "duration": 2.0, "plan_only": True, **fields})  # type: ignore[arg-type]
        check_goal(goal, self.primitive, self.config)
        origin = Origin(0.0, 0, Boundary(self.config.home, np.zeros(joints), np.zeros(joints)), correction)
        with pytest.raises(StopIteration) as done:
            next(self.solver.solve(goal, self.primitive, origin))
        return done.value.value

    def tool_pose_at(self, *moved: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the tool's position (3,) and rotation (3, 3) with joints `moved`, rad, from home."""
        return self.kinematics.tool_pose(self.config.home + np.resize(moved, self.config.joint_count))

    def end(self, made: Made) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return position, rotation and velocity of the tool at the end of a plan."""
        end = made.plan.request.goal
        return *self.kinematics.tool_pose(end.positions), self.kinematics.tool_velocity(end.positions, end.velocities)


@pytest.fixture(scope="module", params=ARMS)
def harness(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> SolverHarness:
    """A harness for each of the arms."""
    config = load_robot(ARMS[request.param].write(tmp_path_factory.mktemp("robot")))
    times = np.linspace(0, 1, 101)
    shape = 3 * times**2 - 2 * times**3
    movement = config.home + np.outer(shape, np.resize([0.4, -0.3], config.joint_count))
    primitive = learn(Demonstration(2 * times, movement))
    return SolverHarness(request.param, config, Solver(config), Kinematics(config), primitive)


def test_position_axis_and_velocity_of_the_tool_are_met(harness: SolverHarness):
    position, rotation = harness.tool_pose_at(0.3, -0.2, 0.25)
    velocity = 0.15 * rotation[:, 0]
    tool = m.ToolGoal(position=tuple(position), axis=tuple(rotation[:, 2]), velocity=tuple(velocity))
    made = harness.solved(tool=tool)
    at, turned, moves = harness.end(made)
    assert np.abs(at - position).max() < 1e-8
    assert turned[:, 2] == pytest.approx(rotation[:, 2], abs=1e-8)
    assert moves == pytest.approx(velocity, abs=1e-8)
    assert made.plan.report.certified
    assert made.alternative == 0


def test_orientation_and_angular_velocity_of_the_tool_are_met(harness: SolverHarness):
    position, rotation = harness.tool_pose_at(0.3, -0.2, 0.25)
    quaternion: Any = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, rotation.flatten())
    if harness.config.joint_count == 5:
        aside = m.ToolGoal(position=tuple(position), orientation=tuple(quaternion + np.array([0, 0.2, -0.3, 0.1])))
        assert refused(harness, tool=aside).detail["reason"] == "orientation"
        return
    tool = m.ToolGoal(
        position=tuple(position),
        orientation=tuple(3 * quaternion),
        velocity=(0.05, 0.0, 0.1),
        angular_velocity=(0.0, 0.2, 0.0),
    )
    made = harness.solved(tool=tool)
    at, turned, moves = harness.end(made)
    assert np.abs(at - position).max() < 1e-8
    assert turned == pytest.approx(rotation, abs=1e-8)
    assert moves == pytest.approx([0.05, 0.0, 0.1], abs=1e-8)
    nudge = 1e-6 * made.plan.request.goal.velocities
    _, later = harness.kinematics.tool_pose(made.plan.request.goal.positions + nudge)
    turning = (later - turned) @ turned.T / 1e-6
    assert [turning[2, 1], turning[0, 2], turning[1, 0]] == pytest.approx([0.0, 0.2, 0.0], abs=1e-5)


def test_the_posture_with_the_least_imitation_error_is_chosen(harness: SolverHarness):
    """If the demonstration ends in the pose, that is the demonstration's posture."""
    wanted = harness.config.home + np.resize([0.4, -0.3], harness.config.joint_count)
    position, rotation = harness.kinematics.tool_pose(wanted)
    made = harness.solved(tool=m.ToolGoal(position=tuple(position), axis=tuple(rotation[:, 2])))
    assert made.plan.request.goal.positions == pytest.approx(wanted, abs=1e-5)
    assert made.plan.request.goal.velocities == pytest.approx(np.zeros(harness.config.joint_count))


def test_a_repeated_goal_has_the_same_posture(harness: SolverHarness):
    position, _ = harness.tool_pose_at(0.2, 0.1)
    first, again = (harness.solved(tool=m.ToolGoal(position=tuple(position))) for _ in range(2))
    assert np.array_equal(first.plan.request.goal.positions, again.plan.request.goal.positions)


def test_a_waypoint_in_tool_space_is_met(harness: SolverHarness):
    position, rotation = harness.tool_pose_at(0.15, -0.1, 0.2)
    tool = m.ToolGoal(position=tuple(position), axis=tuple(rotation[:, 2]), velocity=(0.05, 0.0, 0.02))
    joints = m.Waypoint(time_from_start=1.5, velocities=[0.1, *[None] * (harness.config.joint_count - 1)])
    made = harness.solved(waypoints=[joints, m.Waypoint(time_from_start=0.9, tool=tool)], duration=2.0)
    through = next(w for w in made.plan.request.waypoints if w.time_from_start == 0.9)
    at, turned = harness.kinematics.tool_pose(through.positions)
    assert at == pytest.approx(position, abs=1e-8)
    assert turned[:, 2] == pytest.approx(rotation[:, 2], abs=1e-8)
    assert harness.kinematics.tool_velocity(through.positions, through.velocities) == pytest.approx(
        [0.05, 0, 0.02], abs=1e-8
    )


def test_a_correction_keeps_the_posture(harness: SolverHarness):
    """Even if another one has a smaller imitation error."""
    position, _ = harness.tool_pose_at(0.3, -0.2, 0.25)
    end = harness.solved(tool=m.ToolGoal(position=tuple(position))).plan.request.goal.positions
    elsewhere = m.ToolGoal(position=tuple(position + ASIDE))
    corrected = harness.solved(Correction(0.2, 2.0, tuple(end)), tool=elsewhere)
    assert np.abs(corrected.plan.request.goal.positions - end).max() < 0.2
    assert harness.end(corrected)[0] == pytest.approx(position + ASIDE, abs=1e-8)


def refused(harness: SolverHarness, **fields: Any) -> Refusal:
    """Return the refusal that a goal must get."""
    with pytest.raises(Refusal) as caught:
        harness.solved(**fields)
    return caught.value


def test_the_duration_with_the_least_imitation_error_is_chosen(harness: SolverHarness):
    """The index is that of the goal's alternative, for any posture."""
    position, _ = harness.tool_pose_at(0.2, -0.15)
    tool = m.ToolGoal(position=tuple(position), velocity=(0.1, 0.0, 0.1))
    made = harness.solved(tool=tool, duration=0.9, alternatives=[m.Alternative(duration=t) for t in (1.0, 2.0, 1.1)])
    assert (made.alternative, made.plan.duration) == (2, 2.0)
    assert harness.end(made)[0] == pytest.approx(position, abs=1e-6)
    assert harness.end(made)[2] == pytest.approx([0.1, 0.0, 0.1], abs=1e-6)
    many = [m.Alternative(duration=0.9 + k / 1000) for k in range(256)]
    assert harness.solved(tool=tool, duration=0.5, alternatives=many).alternative > 0


def test_an_unreachable_goal_is_refused_with_the_nearest_pose(harness: SolverHarness):
    far = refused(harness, tool=m.ToolGoal(position=(3.0, 0.0, 0.5)))
    assert (far.code, far.detail["reason"]) == ("unreachable", "out of reach")
    nearest = far.detail["nearest"]
    assert np.linalg.norm(np.array(nearest["position"]) - [3.0, 0.0, 0.5]) == pytest.approx(far.detail["distance"])
    near = m.ToolGoal(position=tuple(nearest["position"]), orientation=tuple(nearest["orientation"]))
    assert harness.solved(tool=near, duration=8.0), "the nearest pose can be tool_pose_at"


def test_a_tool_velocity_beyond_a_joints_limit_is_refused_with_one_that_works(harness: SolverHarness):
    position, _ = harness.tool_pose_at(0.3, -0.2, 0.25)
    refusal = refused(harness, tool=m.ToolGoal(position=tuple(position), velocity=(0.0, 9.0, 0.0)))
    assert (refusal.code, refusal.detail["reason"]) == ("unreachable", "velocity")
    assert refusal.detail["distance"] < 1e-6
    assert "whose limit is 3 rad/s" in refusal.message
    share = float(refusal.message.rsplit("; ", 1)[1].split()[0])
    works = m.ToolGoal(position=tuple(position), velocity=(0.0, 9.0 * share, 0.0))
    assert harness.solved(
        tool=works, duration=8.0, checks=m.Checks(collision=False)
    )  # the motion collides with the arm itself


def test_joint_ranges_are_distinguished_from_reach(harness: SolverHarness):
    """Ranges close to home make the pose unreachable."""
    position, _ = harness.tool_pose_at(0.5, -0.4, 0.3)
    ranges: list[tuple[float, float] | None] = [(value - 0.05, value + 0.05) for value in harness.config.home]
    limits = m.GoalLimits(positions=ranges)
    refusal = refused(harness, tool=m.ToolGoal(position=tuple(position)), limits=limits)
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
def test_contradictory_tool_goals_are_refused_with_their_field(
    field: str, fields: dict[str, object], forehand: Primitive
):
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
