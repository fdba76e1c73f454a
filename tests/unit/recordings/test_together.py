"""Joints that were logged at different times are interpolated to common times, or refused."""

from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from services.recorder.entities import GOAL_LANE, MEASURED_POSITION
from tools.recordings import readers
from tools.recordings.learning import load
from tools.recordings.readers.rrd import cut
from tools.recordings.recording import Recording, Unreadable

TWO = "joint_1", "joint_2"
OFFSET = 0.004


def reach(times: np.ndarray | float) -> np.ndarray:
    """Return positions (n, 2), rad, of a reach of 1.5 s at times (n,), s."""
    s = np.clip(np.asarray(times) / 1.5, 0, 1)
    return (s**3 * (10 + s * (6 * s - 15)))[..., None] * [1.0, -0.7] + [0.2, 0.3]


def rows(path: Path, rate: float, offset: float, speed: float = 1.0) -> Recording:
    """Write a table whose rows have one joint each, the second `offset` s after the first, and load it."""
    times = np.arange(0, 1.5, 1 / rate)
    lines = [(time + joint * offset, joint) for time in times for joint in (0, 1)]
    cells = [
        f"{time:.6f}," + ("{:.9f}," if joint == 0 else ",{:.9f}").format(reach(speed * time)[joint])
        for time, joint in lines
    ]
    path.write_text("t,joint_1,joint_2\n" + "\n".join(cells) + "\n", encoding="utf-8")
    return load(path, TWO)


@pytest.mark.parametrize(
    ("rate", "offset", "within"), [(100, OFFSET, 1e-4), (50, 0.01, 1e-4), (20, 0.02, 1e-3), (10, 0.02, 5e-3)]
)
def test_rows_with_one_joint_each_are_interpolated(tmp_path: Path, rate: float, offset: float, within: float):
    recording = rows(tmp_path / "demo.csv", rate, offset)
    assert np.abs(reach(recording.times) - recording.values).max() < within
    assert any("ms apart, and are interpolated" in note for note in recording.notes)


def test_joints_with_separate_columns_of_times_are_interpolated(tmp_path: Path):
    times = np.arange(0, 1.5, 0.01)
    rows = zip(times, reach(times)[:, 0], times + OFFSET, reach(times + OFFSET)[:, 1], strict=True)
    lines = "".join(",".join(f"{1000 * a:.3f},{x:.9f}" for a, x in ((t, p), (u, q))) + "\n" for t, p, u, q in rows)
    (tmp_path / "demo.csv").write_text("t1 [ms],joint_1,t2 [ms],joint_2\n" + lines, encoding="utf-8")
    recording = load(tmp_path / "demo.csv", TWO)
    assert np.abs(reach(recording.times) - recording.values).max() < 1e-4


def test_a_movement_too_fast_for_its_sample_rate_is_refused(tmp_path: Path):
    with pytest.raises(Unreadable, match=r"joint_\d moves too much between its \d+ samples"):
        rows(tmp_path / "demo.csv", 7, 0.05, speed=3.0)


def test_interpolation_keeps_the_jump_of_a_wrapped_angle(tmp_path: Path):
    times = np.arange(0, 1.5, 0.01)
    wrapped = lambda at: np.mod(reach(at)[:, 0] + 2.5 + np.pi, 2 * np.pi) - np.pi  # noqa: E731
    lines = [f"{a:.6f},{x:.9f},\n{b:.6f},,0.5\n" for a, b, x in zip(times, times + OFFSET, wrapped(times), strict=True)]
    (tmp_path / "demo.csv").write_text("t,joint_1,joint_2\n" + "".join(lines), encoding="utf-8")
    recording = load(tmp_path / "demo.csv", TWO)
    assert np.abs(np.diff(recording.values[:, 0])).max() > 6.2
    assert np.abs(np.diff(np.unwrap(recording.values[:, 0]))).max() < 0.05


def test_with_a_rate_the_samples_of_all_joints_are_paired_by_number(tmp_path: Path):
    with rr.RecordingStream("test") as stream:
        stream.save(str(tmp_path / "demo.rrd"))
        for row in reach(np.arange(150) / 100):
            for name, value in zip(TWO, row, strict=True):
                stream.log(name, rr.Scalars(value))
    recording = load(tmp_path / "demo.rrd", TWO, rate=100.0)
    assert np.abs(reach(recording.times) - recording.values).max() < 1e-9
    assert (len(recording.times), recording.times[-1]) == (150, pytest.approx(1.49))
    assert "times are those of log_time" in load(tmp_path / "demo.rrd", TWO).notes[0]


def test_the_largest_number_of_samples_is_that_of_a_movement_of_a_trace(tmp_path: Path, monkeypatch):
    monkeypatch.setattr("tools.recordings.recording.MAX_SAMPLES", 100)
    with rr.RecordingStream("test") as stream:
        stream.save(str(tmp_path / "trace.rrd"))
        for time in np.arange(150) / 100:
            stream.set_time("sim_time", duration=time)
            if time in (0.0, 0.8):
                stream.log(GOAL_LANE.path, rr.StateChange(state=f"goal-{time:g}"))
            for name, value in zip(TWO, reach(time), strict=True):
                stream.log(MEASURED_POSITION.path.replace("JOINT", name), rr.Scalars(value))
    recording = load(tmp_path / "trace.rrd", TWO, episode="goal-0.8")
    assert (len(recording.times), recording.times[-1]) == (70, pytest.approx(0.69))
    with pytest.raises(Unreadable, match="part has 150 samples; at most 100 are read"):
        cut(tmp_path / "trace.rrd", 0.0, 2.0)


def test_series_names_of_an_entity_name_its_values(tmp_path: Path):
    with rr.RecordingStream("test") as stream:
        stream.save(str(tmp_path / "demo.rrd"))
        stream.log("arm", rr.SeriesLines(names=["joint_2", "joint_1"]), static=True)
        for time in np.arange(150) / 100:
            stream.set_time("time", duration=time)
            stream.log("arm", rr.Scalars(reach(time)[::-1]))
    recording = load(tmp_path / "demo.rrd", TWO)
    assert np.abs(reach(recording.times) - recording.values).max() < 1e-9


@pytest.mark.parametrize("kind", ["JointState", "Float64"])
def test_a_topic_for_each_joint_is_combined(tmp_path: Path, kind: str):
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
        name = "sensor_msgs/msg/JointState" if kind == "JointState" else "std_msgs/msg/Float64"
        topics = [bag.add_connection(f"/arm/{joint}/position", name, typestore=store) for joint in TWO]
        for k in range(300):
            joint, ns = k % 2, round((1000 + (k // 2) / 100 + (k % 2) * OFFSET) * 1e9)
            value = float(reach(ns / 1e9 - 1000)[joint])
            if kind == "JointState":
                stamp = types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
                header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
                message = types[name](header, [TWO[joint]], np.array([value]), np.zeros(0), np.zeros(0))
            else:
                message = types[name](data=value)
            bag.write(topics[joint], ns, store.serialize_cdr(message, name))
    assert [one.name for one in readers.episodes(tmp_path / "bag")][-1] == "all"
    recording = load(tmp_path / "bag", TWO, episode="all")
    assert np.abs(reach(recording.times) - recording.values).max() < 1e-4
