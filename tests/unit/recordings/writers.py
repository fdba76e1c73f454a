"""Files of other programs, each written by that program's own library, all of the same movement."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import rerun as rr
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_typestore

JOINTS = tuple(f"joint_{number}" for number in range(1, 7))
"""Joints of the shipped arm."""

RATE_HZ = 100.0
TIMES = np.arange(151) / RATE_HZ
STARTS = np.array([0.1, -0.4, 0.3, 0.9, -0.2, 0.5])
ENDS = np.array([0.5, 0.3, -0.2, 0.4, 0.6, -0.3])

JOINT_STATE = "sensor_msgs/msg/JointState"
START_NS = 1_790_000_000_000_000_000


def movement() -> np.ndarray:
    """Return positions (n, 6), rad, of a reach at TIMES, at rest at both ends."""
    s = TIMES / TIMES[-1]
    return STARTS + (s**3 * (10 + s * (6 * s - 15)))[:, None] * (ENDS - STARTS)


def write_csv(path: Path) -> None:
    """Write a driver's table: times in ms, degrees, the elbow first, a velocity, a gripper and a column of text."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        order = [2, 1, 0, 3, 4, 5]
        header = ["timestamp_ms", *(f"{JOINTS[joint]}_deg" for joint in order), "joint_1_vel", "gripper", "task"]
        writer.writerow(header)
        for time, row in zip(TIMES, np.degrees(movement()), strict=True):
            writer.writerow([round(1000 * time), *row[order], 0.0, 1, "reach"])


def write_npz(path: Path) -> None:
    """Write times, positions and joint names."""
    with path.open("wb") as file:
        np.savez(file, t=TIMES, positions=movement(), joint_names=np.array(JOINTS))


def write_aloha(path: Path) -> None:
    """Write one arm in ALOHA's layout, which has neither names nor times."""
    with h5py.File(path, "w") as file:
        file.attrs["sim"] = False
        observations = file.create_group("observations")
        observations.create_dataset("qpos", data=movement()[::2])
        observations.create_dataset("qvel", data=np.zeros_like(movement()[::2]))
        file.create_dataset("action", data=movement()[::2])


def write_robomimic(path: Path) -> None:
    """Write eleven demonstrations in robomimic's layout; the first is the movement."""
    with h5py.File(path, "w") as file:
        data = file.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_name": "Lift", "env_kwargs": {"control_freq": 20}})
        for number in range(11):
            obs = data.create_group(f"demo_{number}").create_group("obs")
            positions = movement()[::5] + 0.01 * number
            obs.create_dataset("robot0_joint_pos", data=positions)
            obs.create_dataset("robot0_joint_pos_sin", data=np.sin(positions))
            obs.create_dataset("robot0_joint_vel", data=np.zeros_like(positions))
            obs.create_dataset("robot0_gripper_qpos", data=np.zeros((len(positions), 2)))


def _joint_state(store, names, position, stamp_ns, ros1=False):
    types = store.types
    time = types["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    sequence = {"seq": 0} if ros1 else {}
    header = types["std_msgs/msg/Header"](stamp=time, frame_id="", **sequence)
    empty = np.zeros(0)
    return types[JOINT_STATE](header=header, name=list(names), position=position, velocity=empty, effort=empty)


def write_bag(path: Path) -> None:
    """Write a ROS 1 bag with one topic."""
    store = get_typestore(Stores.ROS1_NOETIC)
    with BagWriter(path) as bag:
        connection = bag.add_connection("/joint_states", JOINT_STATE, typestore=store)
        for time, row in zip(TIMES, movement(), strict=True):
            stamp = START_NS + round(1e9 * time)
            message = _joint_state(store, JOINTS, row, stamp, ros1=True)
            bag.write(connection, stamp + 400_000, store.serialize_ros1(message, JOINT_STATE))


def write_bag2(path: Path, storage: StoragePlugin = StoragePlugin.SQLITE3) -> None:
    """Write a ROS 2 bag: a topic with messages of arm and gripper in turn, and a topic of text."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Bag2Writer(path, version=9, storage_plugin=storage) as bag:
        states = bag.add_connection("/joint_states", JOINT_STATE, typestore=store)
        text = bag.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        for time, row in zip(TIMES, movement(), strict=True):
            stamp = START_NS + round(1e9 * time)
            for names, positions in ((JOINTS[::-1], row[::-1].copy()), (("finger_joint",), np.zeros(1))):
                message = _joint_state(store, names, positions, stamp)
                bag.write(states, stamp + 400_000, store.serialize_cdr(message, JOINT_STATE))
        word = store.types["std_msgs/msg/String"](data="done")
        bag.write(text, START_NS, store.serialize_cdr(word, "std_msgs/msg/String"))


MCAP_DEFINITION = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def write_mcap(path: Path) -> None:
    """Write an MCAP file with Foxglove's writer."""
    with path.open("wb") as file:
        writer = McapWriter(file)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", MCAP_DEFINITION)
        for time, row in zip(TIMES, movement(), strict=True):
            stamp = START_NS + round(1e9 * time)
            header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": ""}
            message = {"header": header, "name": list(JOINTS), "position": row.tolist(), "velocity": [], "effort": []}
            writer.write_message("/joint_states", schema, message, log_time=stamp, publish_time=stamp)
        writer.finish()


def write_rrd(path: Path) -> None:
    """Write a Rerun recording with one scalar entity for each joint and one for a reward."""
    recording = rr.RecordingStream("other_program")
    recording.save(path)
    for index, (time, row) in enumerate(zip(TIMES, movement(), strict=True)):
        recording.set_time("step", sequence=index)
        recording.set_time("time", duration=float(time))
        for joint, value in zip(JOINTS, row, strict=True):
            recording.log(f"robot/{joint}", rr.Scalars(value))
        recording.log("reward", rr.Scalars(1.0))
    recording.flush()
    recording.disconnect()


FILES: dict[str, tuple[str, Callable[[Path], None], float]] = {
    "csv": ("driver.csv", write_csv, RATE_HZ),
    "npz": ("arrays.npz", write_npz, RATE_HZ),
    "aloha": ("episode_0.hdf5", write_aloha, 50.0),
    "robomimic": ("low_dim.hdf5", write_robomimic, 20.0),
    "bag": ("run.bag", write_bag, RATE_HZ),
    "db3": ("rosbag2", write_bag2, RATE_HZ),
    "mcap": ("run.mcap", write_mcap, RATE_HZ),
    "rrd": ("log.rrd", write_rrd, RATE_HZ),
}
"""For each format the file's name, its writer and its sample rate, Hz."""
