"""Files of every format are read, matched to the arm, learned and played."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_typestore

from benchmarks.learning import DEMOS
from examples import tool_poses
from experiments.doctor.clean import PANDA as REAL_ARM
from experiments.doctor.clean import STUTTERING
from robot.description import load_robot
from robot.kinematics import Kinematics
from tests import arms
from tests.unit.recordings import writers
from tests.unit.recordings.playing import HOUSEHOLD, play, relative_deviation
from tools.recordings import readers
from tools.recordings.doctor import examine
from tools.recordings.learning import in_radians, load
from tools.recordings.readers.ros import NS
from tools.recordings.recording import Unreadable

HERE = Path(__file__).parent
SO101 = "shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"

ARM = load_robot()


@pytest.mark.parametrize("name", writers.FILES)
def test_files_of_other_programs_are_learned_and_played(tmp_path: Path, name: str):
    file, write, rate_hz = writers.FILES[name]
    write(tmp_path / file)
    episode = "demo_0" if name == "robomimic" else None
    recording = in_radians(load(tmp_path / file, writers.JOINTS, episode=episode))
    every = round(writers.RATE_HZ / rate_hz)
    assert recording.columns == writers.JOINTS
    assert recording.times == pytest.approx(writers.TIMES[::every], abs=1e-6)
    assert recording.values == pytest.approx(writers.movement()[::every], abs=1e-6)
    assert relative_deviation(play(recording, ARM), recording.values).max() < 1


@pytest.mark.parametrize("storage", [None, StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_each_topic_of_a_bag_is_listed_with_its_own_duration(tmp_path: Path, storage: StoragePlugin | None):
    """Two arms' topics of 0.9 s and 1.9 s; another topic lasts 40 s, so that the bag does."""
    store = get_typestore(Stores.ROS1_NOETIC if storage is None else Stores.ROS2_HUMBLE)
    serialize = store.serialize_ros1 if storage is None else store.serialize_cdr
    opened = (
        BagWriter(tmp_path / "bag")
        if storage is None
        else Bag2Writer(tmp_path / "bag", version=9, storage_plugin=storage)
    )
    with opened as bag:
        text = bag.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        for second in (-20, 20):
            word = store.types["std_msgs/msg/String"](data="x")
            bag.write(text, writers.START_NS + second * NS, serialize(word, "std_msgs/msg/String"))
        for topic, samples in (("/left", 10), ("/right", 20)):
            states = bag.add_connection(topic, writers.JOINT_STATE, typestore=store)
            for sample in range(samples):
                stamp = writers.START_NS + sample * NS // 10
                message = writers.joint_state(store, ("joint_1",), np.zeros(1), stamp, ros1=storage is None)
                bag.write(states, stamp + 400_000, serialize(message, writers.JOINT_STATE))
    found = [(one.name, one.samples, one.duration) for one in readers.episodes(tmp_path / "bag")]
    assert found == [("/left", 10, pytest.approx(0.9)), ("/right", 20, pytest.approx(1.9))]
    assert readers.episodes(tmp_path / "bag", rate=19.0)[1].duration == pytest.approx(1.0)


@pytest.mark.parametrize("folder", ["lerobot_v2", "lerobot_v3"])
def test_data_sets_written_by_lerobot_are_learned_and_played(tmp_path: Path, folder: str):
    """By versions 0.3.3 and 0.4.4; in degrees, which the files do not declare."""
    found = readers.episodes(HERE / "files" / folder)
    assert [(one.name, one.samples) for one in found] == [("0", 60), ("1", 75)]
    recording = in_radians(load(HERE / "files" / folder, SO101, episode="1", unit="deg"))
    assert (recording.stamped, recording.times[1]) == (False, pytest.approx(1 / 30))
    assert np.degrees(recording.values[[0, -1], 0]) == pytest.approx([-10, 45], abs=1e-4)
    assert np.degrees(recording.values[[0, -1], 5]) == pytest.approx([2, 35], abs=1e-4)
    arm = arms.SO101
    without_gripper = in_radians(load(HERE / "files" / folder, arm.joints, episode="1", unit="deg"))
    assert relative_deviation(play(without_gripper, load_robot(arm.write(tmp_path))), without_gripper.values).max() < 1


@pytest.mark.skipif(not DEMOS.exists(), reason="the recordings lie outside the repository")
@pytest.mark.parametrize(("task", "duration"), HOUSEHOLD.items())
def test_recordings_of_a_real_arm_are_played(tmp_path: Path, task: str, duration: float):
    """Their columns are a phase and q1 to q7; two recordings stutter, which the doctor repairs."""
    (path,) = DEMOS.glob(f"robottasks_{task}_*.csv")
    recording = in_radians(load(path, arms.PANDA.joints, duration=duration))
    assert (len(recording.times), recording.times[-1]) == (1000, duration)
    examination = examine(recording, REAL_ARM)
    assert any(finding.code == "stutter" for finding in examination.findings) == (task in STUTTERING)
    mended = examination.recording
    assert relative_deviation(play(mended, load_robot(arms.PANDA.write(tmp_path))), mended.values).max() < 1


@pytest.mark.skipif(not DEMOS.exists(), reason="the recordings lie outside the repository")
def test_tool_poses_are_refused_and_played_as_joint_positions(tmp_path: Path, monkeypatch):
    """The file has nine recordings of tool poses in one array; the example converts one to joint positions."""
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
    assert relative_deviation(played, mended.values).max() < 1
    assert Kinematics(robot).tool_pose(played[-1])[0] == pytest.approx(poses[-1, :3], abs=1e-3)
