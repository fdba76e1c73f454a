"""ROS bags: topics of sensor_msgs/JointState in a ROS 1 bag, a ROS 2 db3 or MCAP file, or a directory of such files.

Messages are decoded by the definitions in rosbags. The definitions in the bag are not used, because rosbags compiles
definitions into code.
"""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Reader as Bag1
from rosbags.rosbag2 import Reader as Bag2
from rosbags.rosbag2 import ReaderError
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader
from rosbags.typesys import Stores, get_typestore

from tools.recordings.names import POSES_CURE, is_pose
from tools.recordings.recording import Episode, Recording, Unreadable, check_size, head

TYPE = "sensor_msgs/msg/JointState"
NUMBERS = "std_msgs/msg/Float64", "std_msgs/msg/Float32"
ALL = "all"
"""Name of the episode with all topics."""

NS = 1_000_000_000


def episodes(path: Path, rate: float | None) -> list[Episode]:
    """Return an episode for each topic of joint states, and one with all topics if these have different joints."""
    with _opened(path) as (bag, decode):
        topics = sorted({one.topic for one in bag.connections if one.msgtype == TYPE})
        if not topics and not _connections(bag, ALL) and bag.connections:
            raise Unreadable(_without_joints(path, bag))
        if not topics or _have_different_joints(bag, decode, topics):
            topics.append(ALL)
        found = []
        for topic in topics:
            samples = sum(one.msgcount for one in _connections(bag, topic))
            check_size(path, topic, samples)
            if samples:
                found.append(
                    Episode(topic, samples, _duration(bag, decode, topic) if rate is None else (samples - 1) / rate)
                )
        return found


def read(path: Path, episode: str, rate: float | None) -> Recording:
    """Return the positions of a topic, with a column for each joint in any message, NaN in messages without it."""
    with _opened(path) as (bag, decode):
        rows: list[dict[str, float]] = []
        stamps: list[tuple[int, int]] = []
        unlike = ""
        for connection, received, raw in bag.messages(_connections(bag, episode)):
            message = decode(raw, connection.msgtype)
            if connection.msgtype in NUMBERS:
                rows.append({connection.topic: float(message.data)})
                stamps.append(_stamp(message, received))
            elif len(message.position) and len(message.position) == len(message.name):
                rows.append(dict(zip(message.name, message.position.tolist(), strict=True)))
                stamps.append(_stamp(message, received))
            else:
                unlike = f"{len(message.name)} names and {len(message.position)} positions"
    if not rows:
        said = f"; a message of {episode} has {unlike}" if unlike else ""
        raise Unreadable(f"{path}: no message of {episode} has a position for each of its names{said}")
    columns = tuple(dict.fromkeys(name for row in rows for name in row))
    values = np.array([[row.get(name, np.nan) for name in columns] for row in rows])
    times, notes = _times(np.array(stamps))
    times = times if rate is None else np.arange(len(rows)) / rate
    unit = None if columns[0].startswith("/") else "rad"
    return Recording(times, columns, values, unit, path, episode, rate is None, notes)


def _have_different_joints(bag: Any, decode: Callable[[bytes, str], Any], topics: list[str]) -> bool:
    """Return whether there are several topics, and no joint is in the first messages of two of them."""
    if len(topics) < 2:
        return False
    names: list[str] = []
    for topic in topics:
        for connection, _, raw in bag.messages(_connections(bag, topic)):
            names += decode(raw, connection.msgtype).name
            break
    return len(names) == len(set(names))


def _without_joints(path: Path, bag: Any) -> str:
    topics = ", ".join(sorted(f"{one.topic} ({one.msgtype})" for one in bag.connections)[:8])
    poses = any(is_pose(one.msgtype.split("/")[-1]) for one in bag.connections)
    return f"{path} has no topic of {TYPE}; it has {topics}{f'; {POSES_CURE}' if poses else ''}"


def _duration(bag: Any, decode: Callable[[bytes, str], Any], topic: str) -> float:
    """Return the time between the first and the last message of a topic, s, without reading all of them."""
    connections = _connections(bag, topic)
    ends = [next(bag.messages(connections))]
    end, before = (bag.metadata if _is_2(bag) else bag).end_time, NS
    while len(ends) < 2:
        ends += deque(bag.messages(connections, start=end - before), maxlen=1)
        before *= 2
    stamps = [_stamp(decode(raw, connection.msgtype), received) for connection, received, raw in ends]
    return float(_times(np.array(stamps))[0][-1])


def _stamp(message: Any, received: int) -> tuple[int, int]:
    """Return the time in a message's header, 0 without one, and the time of recording, ns."""
    header = getattr(message, "header", None)
    return (header.stamp.sec * NS + header.stamp.nanosec if header else 0), received


def _times(stamps: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the times in the messages' headers, s, or the times of recording if some messages have no stamp."""
    headers, received = stamps[:, 0], stamps[:, 1]
    if len(headers) < 2 or (np.ptp(headers) and headers[1:].all()):  # the clock of a simulation starts at 0
        return (headers - headers[0]) / NS, ()
    note = "not all messages have stamps; the times at which they were recorded are used"
    return (received - received[0]) / NS, (note,)


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, Callable[[bytes, str], Any]]]:
    """Open a bag of any format, and yield it with the function that decodes its messages."""
    begin = head(path)
    if begin.startswith(b"#ROSBAG"):
        with Bag1(path) as bag:
            yield bag, get_typestore(Stores.ROS1_NOETIC).deserialize_ros1
        return
    bag = Bag2(path).storage if path.is_dir() else McapReader(path) if begin[1:5] == b"MCAP" else Sqlite3Reader(path)
    try:
        bag.open()
    except ReaderError as error:
        if "Profile" not in str(error):
            raise
        raise Unreadable(
            f"{path} is an MCAP file that ROS 2 did not write; save its joint positions as CSV or NPZ"
        ) from None
    try:
        yield bag, get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr
    finally:
        bag.close()


def _connections(bag: Any, topic: str) -> list[Any]:
    """Return the connections of a topic or of all topics: of joint states, or if there are none, of numbers."""
    states = [one for one in bag.connections if one.msgtype == TYPE and topic in (one.topic, ALL)]
    return states or [one for one in bag.connections if one.msgtype in NUMBERS and topic == ALL]


def _is_2(bag: Any) -> bool:
    return hasattr(bag, "metadata")
