"""Files that cannot be learned: each refusal is one sentence with the file and a remedy; no file runs code."""

import os
import pickle
import re
import resource
from pathlib import Path

import h5py
import numpy as np
import pytest
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

from motion.demonstration import Demonstration
from services.planner.learning import learn_demonstration
from tests.unit.recordings import writers
from tools.recordings import readers
from tools.recordings.learning import in_radians, load
from tools.recordings.recording import Unreadable

LINES = "t,joint_1,joint_2\n" + "".join(f"{k / 100},{k / 300},0.5\n" for k in range(50))
TWO = "joint_1", "joint_2"


def refusal(path: Path, joints=TWO, **options) -> str:
    """Load a file that must be refused, and return the sentence."""
    with pytest.raises(Unreadable) as caught:
        load(path, joints, **options)
    sentence = str(caught.value)
    assert str(path) in sentence
    assert "\n" not in sentence
    return sentence


def text(tmp_path: Path, content: str, name: str = "demo.csv") -> Path:
    path = tmp_path / name
    path.write_text(content, encoding="utf-8")
    return path


def test_samples_within_an_instant_are_refused_with_the_flags_that_help(tmp_path: Path) -> None:
    path = text(tmp_path, "t,joint_1,joint_2\n" + "".join(f"{k / 1e5:.6f},{k / 300},0.5\n" for k in range(50)))
    with pytest.raises(Unreadable, match=r"by its times, too short.*--rate.*--duration"):
        in_radians(load(path, TWO))
    assert len(in_radians(load(path, TWO, rate=50.0)).times) == 50


@pytest.mark.parametrize("name", [name for name in writers.FILES if name != "db3"])
@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9])
def test_a_truncated_file_is_refused_or_read_up_to_its_end(tmp_path: Path, name: str, part: float):
    file, write, _ = writers.FILES[name]
    path = tmp_path / file
    write(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: round(part * len(whole))])
    try:
        recording = load(path, writers.JOINTS, episode="0")
    except Unreadable as problem:
        assert str(path) in str(problem)
        assert part == 0 or name == "rrd" or re.search(r"copy (or record )?it again \(", str(problem))
        assert "\n" not in str(problem)
    else:
        assert name in ("csv", "rrd")
        assert len(recording.times) <= len(writers.TIMES)


@pytest.mark.parametrize("name", [name for name in writers.FILES if name != "db3"])
def test_the_format_is_recognised_by_content(tmp_path: Path, name: str):
    _, write, _ = writers.FILES[name]
    path = tmp_path / "recording.dat"
    write(path)
    assert len(load(path, writers.JOINTS, episode="0").columns) == 6


@pytest.mark.parametrize("name", ["demo.csv", "demo.npz", "demo.hdf5", "demo.bag", "demo.mcap", "demo.rrd"])
def test_empty_random_and_absent_files_are_refused(tmp_path: Path, name: str):
    path = tmp_path / name
    assert "No such file" in refusal(path)
    path.write_bytes(b"")
    assert "is empty" in refusal(path)
    path.write_bytes(np.random.default_rng(1).bytes(5000))
    assert "of an unknown format; the known ones are LeRobot, ROS 2" in refusal(path)
    path.unlink()
    path.mkdir()
    assert "is a directory of an unknown format" in refusal(path)


class _Bomb:
    def __reduce__(self):
        return os.mkdir, ("ran",)


def test_pickles_are_refused_without_running_their_code(tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "demo.pkl"
    path.write_bytes(pickle.dumps({"positions": _Bomb()}))
    assert "is a pickle, which could run code" in refusal(path)
    np.savez(tmp_path / "demo.npz", positions=np.array([[_Bomb()]] * 20, dtype=object))
    assert "Python objects, which could run code" in refusal(tmp_path / "demo.npz")
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (
            LINES.replace("0.1,", "0.1,oops ", 1),
            "line 12: joint_1 is 'oops 0.03333333333333333', not a number; correct",
        ),
        (
            LINES.replace("0.1,", "0.1,7,", 1),
            "line 12 has 4 columns where the first line has 3; correct the line or delete it",
        ),
        (LINES.replace("t,", "count,"), "no column of times among count, joint_1, joint_2; name it time or t_ms, or"),
        (LINES.replace("joint", "finger"), "no column for joint_1, joint_2; its columns are t, finger_1"),
        ("t,joint_1,joint_2\n", "no line of numbers"),
        ("just a note about the run\n", "no line of numbers"),
        ("a,b\nred,green\nblue,black\n", "no line of numbers"),
        ("a,b\n1,green\nblue,2\ngrey,red\n", "words and no numbers"),
    ],
)
def test_malformed_tables_are_refused(tmp_path: Path, content: str, sentence: str):
    assert sentence.replace("t, finger_1", "finger_1") in refusal(text(tmp_path, content))


def test_a_recording_of_another_robot_is_refused(tmp_path: Path):
    header = "t," + ",".join(f"panda_joint{k}" for k in range(1, 8))
    path = text(tmp_path, header + "\n" + "".join(f"{k / 100}" + ",0.5" * 7 + "\n" for k in range(50)))
    assert "another robot's: panda_joint7 is not among" in refusal(path, writers.JOINTS)
    ur = "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"
    assert "no column for shoulder_pan_joint" in refusal(path, ur)


def test_a_recording_of_two_arms_needs_a_mapping(tmp_path: Path):
    header = "t," + ",".join(f"{side}_joint_{k}" for side in ("left", "right") for k in (1, 2))
    path = text(tmp_path, header + "\n" + "".join(f"{k / 100},1,2,3,4\n" for k in range(50)))
    sentence = refusal(path)
    assert (
        "2 columns can be joint_1: left_joint_1 and right_joint_1; choose with --map, as --map 'left_*=*'" in sentence
    )
    assert load(path, TWO, mapping={"right_*": "*"}).values[0].tolist() == [3.0, 4.0]


def test_a_recording_of_two_arms_without_names_needs_a_mapping(tmp_path: Path):
    path = tmp_path / "demo.npz"
    np.savez(path, t=np.arange(50) / 50, qpos=np.tile(np.arange(14.0), (50, 1)))
    assert "no column for joint_1, joint_2; its columns are 0, 1, 2" in refusal(path)
    assert load(path, TWO, mapping={"7": "joint_1", "8": "joint_2"}).values[0].tolist() == [7.0, 8.0]


def test_files_without_joint_positions_are_refused(tmp_path: Path):
    np.savez(tmp_path / "demo.npz", image=np.zeros((3, 4, 4, 3)), t=np.arange(3))
    assert "no matrix samples × joints; it has image (3, 4, 4, 3)" in refusal(tmp_path / "demo.npz")
    with h5py.File(tmp_path / "demo.hdf5", "w") as file:
        file["images"] = np.zeros((3, 4, 4))
    assert "of the format HDF5 it needs a matrix named qpos" in refusal(tmp_path / "demo.hdf5")
    store = get_typestore(Stores.ROS2_HUMBLE)
    with BagWriter(tmp_path / "bag", version=9) as bag:
        bag.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
    assert "no topic of sensor_msgs/msg/JointState; it has /chatter" in refusal(tmp_path / "bag")


def test_positions_that_are_text_are_refused(tmp_path: Path):
    positions = np.zeros((20, 3)).astype("S8")
    np.savez(tmp_path / "text.npz", qpos=positions)
    with h5py.File(tmp_path / "text.hdf5", "w") as file:
        file["obs/qpos"] = positions
    for name, array in (("text.npz", "qpos"), ("text.hdf5", "obs/qpos")):
        assert f"{array}, (20, 3), has text, not numbers; save it as an array of float" in refusal(tmp_path / name)


def test_tool_poses_are_refused_with_a_pointer_to_the_example(tmp_path: Path):
    remedy = "examples/tool_poses.py computes joint positions from poses"
    np.savez(tmp_path / "demo.npz", ee_pose=np.zeros((50, 7)), t=np.arange(50))
    assert remedy in refusal(tmp_path / "demo.npz")
    with h5py.File(tmp_path / "demo.hdf5", "w") as file:
        file["data/demo_0/obs/robot0_eef_pos"] = np.zeros((50, 3))
    assert remedy in refusal(tmp_path / "demo.hdf5")
    lines = "".join(f"{k / 100},0.3,0.1,0.{k:02},1,0,0,0\n" for k in range(50))
    assert remedy in refusal(text(tmp_path, "t,x,y,z,qw,qx,qy,qz\n" + lines))
    assert remedy in refusal(text(tmp_path, lines), tuple(f"joint_{k}" for k in range(1, 8)))
    with BagWriter(tmp_path / "bag", version=9) as bag:
        store = get_typestore(Stores.ROS2_HUMBLE)
        bag.add_connection("/tool", "geometry_msgs/msg/PoseStamped", typestore=store)
    assert remedy in refusal(tmp_path / "bag")


def test_joints_of_robomimic_are_not_taken_for_a_gripper(tmp_path: Path):
    writers.write_robomimic(tmp_path / "demo.hdf5")
    sentence = refusal(tmp_path / "demo.hdf5", TWO, episode="demo_0")
    assert "its joints are another robot's: joint_3" in sentence


def test_one_of_several_episodes_must_be_chosen(tmp_path: Path):
    writers.write_robomimic(tmp_path / "demo.hdf5")
    sentence = refusal(tmp_path / "demo.hdf5", writers.JOINTS)
    assert "has 11 episodes; choose one with --episode: demo_0, demo_1, demo_2" in sentence
    assert load(tmp_path / "demo.hdf5", writers.JOINTS, episode="demo_10").episode == "demo_10"
    assert load(tmp_path / "demo.hdf5", writers.JOINTS, episode="last").episode == "demo_10"
    assert "no episode 'demo_11'" in refusal(tmp_path / "demo.hdf5", writers.JOINTS, episode="demo_11")


@pytest.mark.parametrize(
    "magic",
    [b"", b"t,a\n0,1\n", b"PK\x03\x04", b"\x89HDF\r\n\x1a\n", b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"RRF2"],
)
def test_a_file_of_2_gib_is_refused_without_reading_it(tmp_path: Path, magic: bytes):
    path = tmp_path / "huge"
    path.write_bytes(magic)
    os.truncate(path, 2 * 2**30)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert "2048 MiB" in refusal(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000


def test_zeros_after_a_trace_are_not_read(tmp_path: Path):
    """A disk that failed or was full leaves a trace that is followed by zeros, here 2 GiB of them."""
    writers.write_rrd(tmp_path / "log.rrd")
    whole = load(tmp_path / "log.rrd", writers.JOINTS)
    os.truncate(tmp_path / "log.rrd", 2 * 2**30)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    extended = load(tmp_path / "log.rrd", writers.JOINTS)
    assert np.array_equal(extended.values, whole.values)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000


def test_a_damaged_rerun_file_is_named_by_its_own_path(tmp_path: Path):
    """Its complete messages are copied to a temporary file, which does not appear in the sentence."""
    path = tmp_path / "log.rrd"
    path.write_bytes(b"RRF2" + bytes(1000))
    assert f"at {path}:" in refusal(path)


def test_more_than_a_million_samples_are_refused(tmp_path: Path):
    with h5py.File(tmp_path / "demo.hdf5", "w") as file:
        file.create_dataset("qpos", shape=(2_000_000, 6), dtype=float)
    assert "qpos has 2000000 samples; at most 1000000 are read" in refusal(tmp_path / "demo.hdf5")


def test_100_000_samples_are_learned(tmp_path: Path):
    times = np.linspace(0, 25, 100_000)
    positions = np.stack([np.sin(0.3 * times), np.cos(0.2 * times)], axis=1)
    np.savez(tmp_path / "long.npz", t=times, positions=positions, joint_names=np.array(TWO))
    recording = in_radians(load(tmp_path / "long.npz", TWO))
    learned = learn_demonstration(Demonstration(recording.times, recording.values), "auto")
    assert learned.samples == 100_000
    assert learned.position_max.max() < 1e-3


def test_a_missing_optional_dependency_is_reported_with_the_command_that_installs_it(tmp_path: Path, monkeypatch):
    writers.write_aloha(tmp_path / "demo.hdf5")
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    monkeypatch.delitem(__import__("sys").modules, f"{readers.__name__}.hdf5", raising=False)
    assert "is of the format HDF5, which h5py reads: pip install 'volley[hdf5]'" in refusal(tmp_path / "demo.hdf5")
