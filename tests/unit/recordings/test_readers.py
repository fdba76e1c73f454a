"""Each format: a file that another program wrote is read, matched to the arm, learned and planned."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.learning import DEMOS
from examples.tool_poses import joints_along
from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import learn
from motion.request import MotionRequest
from robot.description import load_robot
from robot.kinematics import Kinematics
from robot.tool_target import ToolTarget, rotation_of
from tests import arms
from tests.unit.recordings import writers
from tools.recordings import readers
from tools.recordings.learning import in_radians, load
from tools.recordings.recording import Recording, Unreadable

HERE = Path(__file__).parent
SO101 = "shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"
PANDA = tuple(f"joint{number}" for number in range(1, 8))

DEVIATION_SHARE, DEVIATION = 0.01, 0.005
"""Of a joint's range, and rad: the larger is the bound of a played movement."""


def deviation(recording: Recording) -> np.ndarray:
    """Distance, rad, of the planned motion from each sample (n, J), in units of the bound."""
    primitive = learn(Demonstration(recording.times, recording.values))
    ends = primitive.start, primitive.goal
    free = Limits.unlimited(primitive.joint_count)
    made = plan(primitive, MotionRequest(*ends, primitive.duration, free, tail="coast"))
    played = made.sample(recording.times - recording.times[0]).positions
    bound = np.maximum(DEVIATION_SHARE * np.ptp(recording.values, axis=0), DEVIATION)
    return np.abs(played - recording.values) / bound


@pytest.mark.parametrize("name", writers.FILES)
def test_what_others_wrote_is_learned_and_planned(tmp_path: Path, name: str):
    file, write, rate_hz = writers.FILES[name]
    write(tmp_path / file)
    episode = "demo_0" if name == "robomimic" else None
    recording = in_radians(load(tmp_path / file, writers.JOINTS, episode=episode))
    every = round(writers.RATE_HZ / rate_hz)
    assert recording.columns == writers.JOINTS
    assert recording.times == pytest.approx(writers.TIMES[::every], abs=1e-6)
    assert recording.values == pytest.approx(writers.movement()[::every], abs=1e-6)
    assert deviation(recording).max() < 1


@pytest.mark.parametrize("folder", ["lerobot_v2", "lerobot_v3"])
def test_lerobots_own_data_sets(folder: str):
    """Written by LeRobot 0.3.3 and 0.4.4; degrees, which they do not say."""
    found = readers.episodes(HERE / "files" / folder)
    assert [(one.name, one.samples) for one in found] == [("0", 60), ("1", 75)]
    recording = in_radians(load(HERE / "files" / folder, SO101, episode="1", unit="deg"))
    assert (recording.stamped, recording.times[1]) == (False, pytest.approx(1 / 30))
    assert np.degrees(recording.values[[0, -1], 0]) == pytest.approx([-10, 45], abs=1e-4)
    assert np.degrees(recording.values[[0, -1], 5]) == pytest.approx([2, 35], abs=1e-4)
    assert deviation(recording).max() < 1


@pytest.mark.parametrize("path", sorted(DEMOS.glob("*.csv")), ids=lambda path: path.stem.split("_")[1])
def test_recordings_of_a_real_arm(path: Path):
    """They have a phase for a time, q1 to q7 for the joints, and single samples that jump by up to 17 mrad."""
    recording = in_radians(load(path, PANDA, duration=5.0))
    assert (len(recording.times), recording.times[-1]) == (1000, 5.0)
    apart = deviation(recording)
    assert np.quantile(apart, 0.99) < 1
    assert apart.max() < 2


@pytest.mark.skipif(not DEMOS.exists(), reason="the recordings lie outside the repository")
def test_tool_poses_are_refused_and_become_joint_positions(tmp_path: Path):
    """Nine recordings of a tool in one array: none is taken for joints, and the arm that has that tool can follow."""
    path = DEMOS / "robottasks_pouring_ee.npz"
    with pytest.raises(Unreadable, match=r"poses of the tool .* examples/tool_poses.py makes joint positions"):
        load(path, PANDA)
    robot = load_robot(arms.PANDA.write(tmp_path))
    with np.load(path) as arrays:
        poses = arrays["pose"][0][::5]
    joints = joints_along([ToolTarget(pose[:3], rotation_of(pose[3:])) for pose in poses], robot)
    recording = Recording(np.linspace(0, 5, len(poses)), (), joints, None, path, "pose", False)
    assert deviation(recording).max() < 1
    assert Kinematics(robot).tool_pose(joints[-1])[0] == pytest.approx(poses[-1, :3], abs=1e-6)
