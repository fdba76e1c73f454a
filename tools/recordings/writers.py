"""Writers of recordings: a played motion as a file for other programs and `volley learn`."""

import importlib.util
import json
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tools.recordings.recording import Recording, Unreadable

NS = 1_000_000_000
TOPIC, JOINT_STATE = "/joint_states", "sensor_msgs/msg/JointState"

ROBOT_TYPE = "volley"
"""Names the writer of a data set of LeRobot, which has no field for its unit: positions are in rad."""

TASKS: dict[str, Any] = {
    "index_columns": ["__index_level_0__"],
    "column_indexes": [],
    "columns": [
        {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64"},
        {"name": None, "field_name": "__index_level_0__", "pandas_type": "unicode", "numpy_type": "object"},
    ],
}
"""Metadata that pandas stores with a frame that has an index."""

Writer = Callable[[Recording, Path], None]


def write(recording: Recording, output: Path) -> None:
    """Write a recording in the format of the output's extension.

    Raises:
        Unreadable: the format is unknown, the output exists already, or a package is missing.
    """
    writer = WRITERS.get(output.suffix.lower())
    if writer is None:
        known = ", ".join(suffix for suffix in WRITERS if suffix)
        raise Unreadable(f"{output} has an unknown ending; it must be {known}, or none for a LeRobot data set")
    if output.exists():
        raise Unreadable(f"{output} exists; remove it, or name another file")
    if not len(recording.times):
        raise Unreadable(f"{recording.source}: {recording.episode} has no samples; choose another motion")
    try:
        # In a directory beside the output, so that no part of a file is left where the writer is interrupted.
        with tempfile.TemporaryDirectory(dir=output.parent, prefix=".volley-") as folder:
            written = Path(folder) / output.name
            writer(recording, written)
            written.rename(output)
    except OSError as error:
        raise Unreadable(f"{output} cannot be written: {error.strerror or error}") from None


def write_csv(recording: Recording, output: Path) -> None:
    """Write a header with names, then the time, s, and a column for each joint, rad."""
    header = ",".join(["time", *recording.columns])
    table = np.column_stack([recording.times, recording.values])
    np.savetxt(output, table, fmt="%.9f", delimiter=",", header=header, comments="")


def write_npz(recording: Recording, output: Path) -> None:
    """Write the arrays times, s, positions, rad, and joint_names."""
    np.savez(output, times=recording.times, positions=recording.values, joint_names=np.array(recording.columns))


def write_mcap(recording: Recording, output: Path) -> None:
    """Write messages of sensor_msgs/JointState on /joint_states, as ROS 2 records them."""
    if importlib.util.find_spec("rosbags") is None:
        raise Unreadable(f"{output.name}: MCAP is written by rosbags: pip install 'volley[ros]'")
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Bag
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder) / "bag"
        with Bag(directory, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
            connection = bag.add_connection(TOPIC, JOINT_STATE, typestore=store)
            for time, row in zip(recording.times, recording.values, strict=True):
                stamp = round(time * NS)
                message = _joint_state(store.types, recording.columns, np.ascontiguousarray(row), stamp)
                bag.write(connection, stamp, store.serialize_cdr(message, JOINT_STATE))
        (written,) = directory.glob("*.mcap")
        shutil.copyfile(written, output)


def _joint_state(types: Any, names: tuple[str, ...], positions: np.ndarray, stamp: int) -> Any:
    time = types["builtin_interfaces/msg/Time"](sec=stamp // NS, nanosec=stamp % NS)
    header, nothing = types["std_msgs/msg/Header"](stamp=time, frame_id=""), np.zeros(0)
    return types[JOINT_STATE](header=header, name=list(names), position=positions, velocity=nothing, effort=nothing)


def write_lerobot(recording: Recording, output: Path) -> None:
    """Write a data set of one episode in LeRobot's layout v3.0: evenly spaced frames, float32, rad.

    The action of a frame is the state of the next one, as for an arm that follows its leader without lag.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    times, values = _evenly_spaced(recording)
    count, joints = values.shape
    fps = _rate(times)
    states, index = values.astype(np.float32), np.arange(count)
    actions = np.vstack([states[1:], states[-1:]])
    columns: dict[str, pa.Array] = {
        "observation.state": pa.FixedSizeListArray.from_arrays(states.ravel(), joints),
        "action": pa.FixedSizeListArray.from_arrays(actions.ravel(), joints),
        "timestamp": pa.array((index / fps).astype(np.float32)),
        **{name: pa.array(index) for name in ("frame_index", "index")},
        **{name: pa.array(np.zeros(count, int)) for name in ("episode_index", "task_index")},
    }
    data, listed = output / "data/chunk-000", output / "meta/episodes/chunk-000"
    data.mkdir(parents=True)
    listed.mkdir(parents=True)
    pq.write_table(pa.table(columns), data / "file-000.parquet")
    task = recording.episode
    episode = {
        "episode_index": 0, "tasks": [task], "length": count, "data/chunk_index": 0, "data/file_index": 0,
        "dataset_from_index": 0, "dataset_to_index": count,
        "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0,
    }  # fmt: skip
    pq.write_table(pa.Table.from_pylist([episode]), listed / "file-000.parquet")
    # LeRobot reads its tasks with pandas, as the index of a frame.
    tasks = pa.table({"task_index": [0], TASKS["index_columns"][0]: [task]}, metadata={"pandas": json.dumps(TASKS)})
    pq.write_table(tasks, output / "meta/tasks.parquet")
    stats = {name: _statistics(np.array(columns[name].to_pylist(), dtype=float).reshape(count, -1)) for name in columns}
    (output / "meta/stats.json").write_text(json.dumps(stats, indent=4))
    (output / "meta/info.json").write_text(json.dumps(_info(recording.columns, count, fps), indent=4))


def _evenly_spaced(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return samples at even steps: the recording's, or interpolated ones if some are missing."""
    times, values = recording.times, recording.values
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    even = times[0] + step * np.arange(round((times[-1] - times[0]) / step) + 1)
    if len(even) == len(times):
        return times, values
    return even, np.column_stack([np.interp(even, times, column) for column in values.T])


def _rate(times: np.ndarray) -> int:
    return max(1, round((len(times) - 1) / (times[-1] - times[0]))) if len(times) > 1 else 1


def _info(names: tuple[str, ...], count: int, fps: int) -> dict[str, Any]:
    """Return meta/info.json."""
    joints = {"dtype": "float32", "shape": [len(names)], "names": list(names)}
    numbers = {name: {"dtype": "int64", "shape": [1], "names": None} for name in _COUNTERS}
    return {
        "codebase_version": "v3.0",
        "robot_type": ROBOT_TYPE,
        "total_episodes": 1,
        "total_frames": count,
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": "0:1"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": {
            "observation.state": joints,
            "action": joints,
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            **numbers,
        },
    }


_COUNTERS = "frame_index", "episode_index", "index", "task_index"


def _statistics(values: np.ndarray) -> dict[str, list[float]]:
    """Return the statistics that LeRobot uses to normalise."""
    quantiles = {f"q{part:02d}": np.quantile(values, part / 100, axis=0).tolist() for part in (1, 10, 50, 90, 99)}
    return {
        "min": values.min(axis=0).tolist(),
        "max": values.max(axis=0).tolist(),
        "mean": values.mean(axis=0).tolist(),
        "std": values.std(axis=0).tolist(),
        "count": [len(values)],
        **quantiles,
    }


WRITERS: dict[str, Writer] = {".csv": write_csv, ".npz": write_npz, ".mcap": write_mcap, "": write_lerobot}
"""Writers by the output's extension."""
