"""Each format: a file that another program wrote is read, matched to the arm, learned and played."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.learning import DEMOS
from examples import tool_poses
from experiments.doctor.clean import PANDA as REAL_ARM
from experiments.doctor.clean import STUTTERING
from robot.description import load_robot
from robot.kinematics import Kinematics
from tests import arms
from tests.unit.recordings import writers
from tests.unit.recordings.playing import HOUSEHOLD, in_bounds, play
from tools.recordings import readers
from tools.recordings.doctor import examine
from tools.recordings.learning import in_radians, load
from tools.recordings.recording import Unreadable

HERE = Path(__file__).parent
SO101 = "shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"

ARM = load_robot()


@pytest.mark.parametrize("name", writers.FILES)
def test_what_others_wrote_is_learned_and_played(tmp_path: Path, name: str):
    file, write, rate_hz = writers.FILES[name]
    write(tmp_path / file)
    episode = "demo_0" if name == "robomimic" else None
    recording = in_radians(load(tmp_path / file, writers.JOINTS, episode=episode))
    every = round(writers.RATE_HZ / rate_hz)
    assert recording.columns == writers.JOINTS
    assert recording.times == pytest.approx(writers.TIMES[::every], abs=1e-6)
    assert recording.values == pytest.approx(writers.movement()[::every], abs=1e-6)
    assert in_bounds(play(recording, ARM), recording.values).max() < 1


@pytest.mark.parametrize("folder", ["lerobot_v2", "lerobot_v3"])
def test_lerobots_own_data_sets_are_learned_and_played(tmp_path: Path, folder: str):
    """Written by LeRobot 0.3.3 and 0.4.4; degrees, which they do not say."""
    found = readers.episodes(HERE / "files" / folder)
    assert [(one.name, one.samples) for one in found] == [("0", 60), ("1", 75)]
    recording = in_radians(load(HERE / "files" / folder, SO101, episode="1", unit="deg"))
    assert (recording.stamped, recording.times[1]) == (False, pytest.approx(1 / 30))
    assert np.degrees(recording.values[[0, -1], 0]) == pytest.approx([-10, 45], abs=1e-4)
    assert np.degrees(recording.values[[0, -1], 5]) == pytest.approx([2, 35], abs=1e-4)
    arm = arms.SO101
    without_gripper = in_radians(load(HERE / "files" / folder, arm.joints, episode="1", unit="deg"))
    assert in_bounds(play(without_gripper, load_robot(arm.write(tmp_path))), without_gripper.values).max() < 1


@pytest.mark.skipif(not DEMOS.exists(), reason="the recordings lie outside the repository")
@pytest.mark.parametrize(("task", "duration"), HOUSEHOLD.items())
def test_recordings_of_a_real_arm_are_played(tmp_path: Path, task: str, duration: float):
    """They have a phase for a time and q1 to q7 for the joints; two stutter, and the doctor mends that."""
    (path,) = DEMOS.glob(f"robottasks_{task}_*.csv")
    recording = in_radians(load(path, arms.PANDA.joints, duration=duration))
    assert (len(recording.times), recording.times[-1]) == (1000, duration)
    examination = examine(recording, REAL_ARM)
    assert any(finding.code == "stutter" for finding in examination.findings) == (task in STUTTERING)
    mended = examination.recording
    assert in_bounds(play(mended, load_robot(arms.PANDA.write(tmp_path))), mended.values).max() < 1


@pytest.mark.skipif(not DEMOS.exists(), reason="the recordings lie outside the repository")
def test_tool_poses_are_refused_and_played_as_joint_positions(tmp_path: Path, monkeypatch):
    """Nine recordings of a tool in one array: none is taken for joints; the example computes those of one."""
    path = DEMOS / "robottasks_pouring_ee.npz"
    with pytest.raises(Unreadable, match=r"poses of the tool .* examples/tool_poses.py computes joint positions"):
        load(path, arms.PANDA.joints)
    poses, config = np.load(path)["pose"][0], arms.PANDA.write(tmp_path)
    np.savez(tmp_path / "pouring.npz", times=np.linspace(0, 10, len(poses)), poses=poses)
    monkeypatch.setattr("sys.argv", ["tool_poses.py", str(tmp_path / "pouring.npz"), str(config)])
    tool_poses.main()
    robot = load_robot(config)
    mended = examine(load(tmp_path / "pouring.joints.npz", robot.joint_names), robot).recording
    played = play(mended, robot)
    assert in_bounds(played, mended.values).max() < 1
    assert Kinematics(robot).tool_pose(played[-1])[0] == pytest.approx(poses[-1, :3], abs=1e-3)
