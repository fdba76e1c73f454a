"""Goals that would move an arm through itself or a table, or beyond its torques, for arms of other projects."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.primitive import Primitive, learn
from motion.request import Boundary
from protocol import messages as m
from protocol.errors import Refusal
from robot.clearance import Clearance
from robot.description import RobotConfig, load_robot
from robot.torques import InverseDynamics
from services.planner.corrections import Correction
from services.planner.goals import Origin
from services.planner.messages import goal_reply
from services.planner.solving import Made, Solver
from tests import arms

ARMS = {"ur5e": arms.UR5E, "panda": arms.PANDA}
TABLE = 0.02
"""Half height of the table under the arm, m."""


def on_a_table(arm: arms.Arm, folder: Path) -> Path:
    """Write a scene with the arm on a table, and return its path."""
    spec = mujoco.MjSpec.from_file(str(arm.model))
    spec.meshdir = str((arm.model.parent / spec.meshdir).resolve())
    for key in spec.keys:
        spec.delete(key)
    box = mujoco.mjtGeom.mjGEOM_BOX
    spec.worldbody.add_geom(name="table", type=box, size=[1, 1, TABLE], pos=[0, 0, -0.03 - TABLE])
    spec.compile()
    scene = folder / "scene.xml"
    scene.write_text(spec.to_xml())
    return scene


@dataclass(frozen=True)
class SolverHarness:
    """An arm on a table, with the planner's solver."""

    name: str
    config: RobotConfig
    solver: Solver
    primitive: Primitive

    def solved(self, correction: Correction | None = None, **fields: Any) -> Made:
        """Plan a goal from home at rest."""
        goal = m.Goal(**{"primitive": "wave", "duration": 2.0, "plan_only": True, **fields})
        origin = Origin(0.0, 0, Boundary(self.config.home, *np.zeros((2, len(self.config.home)))), correction)
        with pytest.raises(StopIteration) as done:
            next(self.solver.solve(goal, self.primitive, origin))
        return done.value.value

    def refused(self, **fields: Any) -> Refusal:
        with pytest.raises(Refusal) as caught:
            self.solved(**fields)
        return caught.value

    def home(self, moved: dict[str, float]) -> list[float | None]:
        """Return the home pose with the named joints at other positions, rad."""
        values: list[float] = self.config.home.tolist()
        return [moved.get(name, value) for name, value in zip(self.config.joint_names, values, strict=True)]

    def distances(self, made: Made, bodies: tuple[str, ...]) -> np.ndarray:
        """Return the distance of two bodies at 1 kHz, (n,), m."""
        clearance = Clearance(self.config, self.config.load_model())
        pairs = [index for index, pair in enumerate(clearance.pairs) if pair.bodies == bodies]
        found = []
        for positions in made.plan.samples().positions:
            clearance.place(positions)
            found.append(min(clearance.distance(pair) for pair in pairs))
        return np.array(found)

    def torques(self, made: Made) -> np.ndarray:
        """Return torques at 1 kHz, (n, J), N·m."""
        dynamics, samples = InverseDynamics(self.config, self.config.load_model()), made.plan.samples()
        states = zip(samples.positions, samples.velocities, samples.accelerations, strict=True)
        return np.array([dynamics.torques(*state) for state in states])


def harness_of(name: str, arm: arms.Arm, folder: Path) -> SolverHarness:
    arm = replace(arm, model=on_a_table(arm, folder))
    file = arm.write(folder)
    file.write_text(file.read_text().replace("20.0", "80.0").replace("500.0", "9e3").replace("3.0", "6.0"))
    config = load_robot(file)
    times = np.linspace(0, 1, 101)
    shape = times**3 * (10 - 15 * times + 6 * times**2)
    movement = config.home + np.outer(shape, np.resize([0.2, -0.15], config.joint_count))
    return SolverHarness(name, config, Solver(config), learn(Demonstration(2 * times, movement)))


@pytest.fixture(scope="module", params=["ur5e", "panda"])
def harness(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> SolverHarness:
    """A UR5e, and a Panda with its hand."""
    return harness_of(request.param, ARMS[request.param], tmp_path_factory.mktemp(request.param))


@dataclass(frozen=True)
class BadGoal:
    """A goal that must be refused: the joints that it moves, rad, and the bodies or joints named by the refusal."""

    moved: dict[str, float]
    names: tuple[str, ...]


SELF = {
    "ur5e": BadGoal({"elbow_joint": 3.1}, ("wrist_3_link", "upper_arm_link")),
    "panda": BadGoal({"joint2": -0.3, "joint4": -3.05, "joint6": 0.0}, ("left_finger", "link2")),
}
SCENE = {
    "ur5e": BadGoal({"shoulder_lift_joint": 0.3}, ("wrist_3_link", "table")),
    "panda": BadGoal({"joint2": 1.7}, ("left_finger", "table")),
}
STRONG = {
    "ur5e": BadGoal({"shoulder_lift_joint": -2.7, "elbow_joint": 0.2}, ("shoulder_lift_joint",)),
    "panda": BadGoal({"joint2": 0.8, "joint4": -0.5}, ("joint2",)),
}
FAST = 0.45


@pytest.mark.parametrize("bad_goals", [SELF, SCENE], ids=["itself", "table"])
def test_a_plan_with_a_collision_is_refused(harness: SolverHarness, bad_goals: dict[str, BadGoal]):
    """The refusal has the bodies, and the first instant found by a replay at 1 kHz."""
    bad = bad_goals[harness.name]
    refusal = harness.refused(positions=harness.home(bad.moved))
    assert (refusal.code, refusal.detail["body"], refusal.detail["other"]) == ("collision", *bad.names)
    made = harness.solved(positions=harness.home(bad.moved), checks=m.Checks(collision=False))
    distances = harness.distances(made, bad.names)
    margin = harness.config.collision.margin
    assert refusal.detail["time_from_start"] == pytest.approx(np.flatnonzero(distances < margin)[0] / 1e3, abs=0.0021)
    assert refusal.detail["distance"] == pytest.approx(distances.min(), abs=5e-3)
    assert made.findings.nearest is None


def test_a_plan_beyond_the_torques_is_refused_with_a_duration_that_works(harness: SolverHarness):
    bad = STRONG[harness.name]
    refusal = harness.refused(positions=harness.home(bad.moved), duration=FAST)
    assert (refusal.code, refusal.detail["quantity"], refusal.detail["joint"]) == ("limit", "torque", *bad.names)
    joint = harness.config.joint_names.index(bad.names[0])
    torques = harness.torques(
        harness.solved(positions=harness.home(bad.moved), duration=FAST, checks=m.Checks(torque=False))
    )
    beyond = np.flatnonzero((np.abs(torques) > harness.config.torques).any(axis=1))
    assert refusal.detail["time_from_start"] == pytest.approx(beyond[0] / 1e3, abs=0.0021)
    assert abs(refusal.detail["value"]) == pytest.approx(np.abs(torques[:, joint]).max(), rel=0.01)
    slower = harness.solved(positions=harness.home(bad.moved), duration=refusal.detail["min_duration"])
    assert slower.findings.torque_use is not None
    assert slower.findings.torque_use[joint] == pytest.approx(
        np.abs(harness.torques(slower)[:, joint]).max() / harness.config.torques[joint], rel=0.01
    )


def test_the_report_has_clearance_and_torque_use(harness: SolverHarness):
    made = harness.solved()
    report = goal_reply(made, "", None, harness.config).report
    assert (report.checked, report.certified) == ("all", True)
    assert report.torque_use is not None
    assert len(report.torque_use) == harness.config.joint_count
    assert report.clearance is not None
    assert 0.01 < report.clearance.distance < 0.05
    unchecked = harness.solved(checks=m.Checks(collision=False, torque=False))
    report = goal_reply(unchecked, "", None, harness.config).report
    assert (report.checked, report.torque_use, report.clearance) == ("none", None, None)


def test_after_an_end_that_collides_the_next_alternative_is_planned(harness: SolverHarness):
    bad = SELF[harness.name]
    other = m.Alternative(positions=(harness.config.home + 0.05).tolist())
    assert harness.solved(positions=harness.home(bad.moved), alternatives=[other]).alternative == 1
    refusal = harness.refused(positions=harness.home(bad.moved), alternatives=[m.Alternative(duration=2.5)])
    assert (refusal.code, refusal.detail["alternatives"]) == ("collision", ["collision"])


def test_a_refusal_of_all_alternatives_names_a_duration(harness: SolverHarness):
    """Goals in tool space depend on this: their postures are alternatives."""
    ends = [m.Alternative(duration=1.01 * FAST)]
    refusal = harness.refused(positions=harness.home(STRONG[harness.name].moved), duration=FAST, alternatives=ends)
    assert (refusal.code, refusal.detail["quantity"]) == ("limit", "torque")
    assert refusal.detail["min_duration"] > FAST


def test_the_fastest_motion_keeps_the_torque_limits(harness: SolverHarness):
    """In 3 % less time the limits cannot be kept."""
    positions = harness.home(STRONG[harness.name].moved)
    made = harness.solved(positions=positions, fastest=True, duration=None)
    assert np.all(np.abs(harness.torques(made)) <= harness.config.torques * 1.001)
    refusal = harness.refused(positions=positions, duration=0.97 * made.plan.duration)
    assert refusal.detail["quantity"] == "torque"


def test_the_fastest_motion_is_found_where_torques_need_many_times_the_duration(harness: SolverHarness):
    """All other limits are so high that they allow a far shorter motion."""
    home = harness.config.home
    loose = Limits(harness.config.limits.positions, 1e3 + 0 * home, 1e5 + 0 * home, 1e8 + 0 * home)
    config = replace(harness.config, limits=loose)
    wide = replace(harness, config=config, solver=Solver(config))
    made = wide.solved(positions=wide.home(STRONG[wide.name].moved), fastest=True, duration=None)
    assert np.all(np.abs(wide.torques(made)) <= wide.config.torques * 1.001)


def test_an_unreachable_tool_goal_names_its_alternatives(harness: SolverHarness):
    ends = [m.Alternative(duration=1.5), m.Alternative(duration=2.5)]
    refusal = harness.refused(tool=m.ToolGoal(position=(5.0, 0.0, 0.0)), alternatives=ends)
    assert (refusal.code, refusal.detail["alternatives"]) == ("unreachable", ["unreachable", "unreachable"])


def test_motions_of_other_methods_are_checked(harness: SolverHarness):
    refusal = harness.refused(positions=harness.home(SELF[harness.name].moved), method="dmp", duration=3.0)
    assert refusal.code == "collision"
