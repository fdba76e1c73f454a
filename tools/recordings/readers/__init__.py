"""Readers of recordings, one module for each format. Only the table `FORMATS` lists the formats.

A reader never runs code from a file: it refuses pickles, and decodes ROS messages by the definitions of rosbags instead
of those in the bag.
"""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar, cast

from tools.recordings.cells import encoding_of
from tools.recordings.recording import Episode, Recording, Unreadable, head

T = TypeVar("T")


class Reader(Protocol):
    """The functions of a module of this package."""

    def episodes(self, path: Path, rate: float | None) -> list[Episode]:
        """Return the movements in a file, which may be none. `rate`: rate of samples without times, Hz."""
        ...

    def read(self, path: Path, episode: str, rate: float | None) -> Recording:
        """Return one of the movements that `episodes` lists."""
        ...


@dataclass(frozen=True, slots=True)
class Format:
    """One format.

    Attributes:
        name: Name in sentences.
        module: Module of this package, which is imported when a file of the format is read.
        fits: Returns whether a file with these first bytes, or a directory (no bytes), is of the format.
        joints: What a file of this format must contain, in words.
        needs: Distribution and extra, if the reader needs a package that Volley does not.
        recovery: A command that may recover a truncated file.
    """

    name: str
    module: str
    fits: Callable[[Path, bytes], bool]
    joints: str
    needs: tuple[str, str] | None = None
    recovery: str = ""

    def load(self, path: Path) -> Reader:
        """Import the reader. Raises Unreadable, with the command that installs a missing package."""
        try:
            return cast(Reader, importlib.import_module(f"{__name__}.{self.module}"))
        except ModuleNotFoundError as error:
            if self.needs is None or (error.name or "").split(".")[0] != self.needs[0]:
                raise
            package, extra = self.needs
            raise Unreadable(
                f"{path} is of the format {self.name}, which {package} reads: pip install 'volley[{extra}]'"
            ) from None


def _begins(*magic: bytes) -> Callable[[Path, bytes], bool]:
    return lambda _path, begin: begin.startswith(magic)


def _holds(member: str) -> Callable[[Path, bytes], bool]:
    return lambda path, _begin: path.is_dir() and (path / member).is_file()


def _is_text(path: Path, begin: bytes) -> bool:
    return not path.is_dir() and encoding_of(begin) is not None


ROS = ("rosbags", "ros")
STATES = "a topic of sensor_msgs/JointState"

LARGE = 256 * 2**20
"""Size, bytes, above which the sentence about an unreadable file reports its size."""

FORMATS: tuple[Format, ...] = (
    Format("LeRobot", "lerobot", _holds("meta/info.json"), "the feature observation.state", ("pyarrow", "lerobot")),
    Format("ROS 2", "ros", _holds("metadata.yaml"), STATES, ROS, "ros2 bag reindex"),
    Format("ROS 2 MCAP", "ros", _begins(b"\x89MCAP0\r\n"), STATES, ROS, "mcap recover"),
    Format("ROS 2 db3", "ros", _begins(b"SQLite format 3\0"), STATES, ROS, "ros2 bag reindex"),
    Format("ROS 1 bag", "ros", _begins(b"#ROSBAG V2.0"), STATES, ROS, "rosbag reindex"),
    Format("HDF5", "hdf5", _begins(b"\x89HDF\r\n\x1a\n"), "a matrix named qpos or …joint_pos…", ("h5py", "hdf5")),
    Format("NPZ", "npz", _begins(b"PK\x03\x04", b"\x93NUMPY"), "a matrix named positions, samples × joints"),
    Format("Rerun", "rrd", _begins(b"RRF"), "Scalars of joint positions"),
    Format("CSV", "csv_table", _is_text, "a line a sample: a time and one number a joint"),
)
"""All formats, the most specific first."""


def format_of(path: Path) -> Format:
    """Return the format of a file by its content, not by its name.

    Raises:
        Unreadable: the file does not exist, is empty, or has an unknown format.
    """
    try:
        begin = head(path)
    except OSError as error:
        raise Unreadable(f"{path} cannot be read: {error.strerror or error}") from None
    if not path.is_dir() and not begin:
        raise Unreadable(f"{path} is empty; record it again")
    for known in FORMATS:
        if known.fits(path, begin):
            return known
    if begin.startswith(b"\x80") and begin[1:2] in b"\x02\x03\x04\x05":
        raise Unreadable(f"{path} is a pickle, which could run code; save its arrays with numpy.savez instead")
    if begin.startswith(b"PAR1"):
        raise Unreadable(f"{path} is one part of a LeRobot data set; name the directory that contains meta/info.json")
    names = ", ".join(dict.fromkeys(known.name for known in FORMATS))
    what = "directory" if path.is_dir() else "file"
    raise Unreadable(f"{path}{_size(path)} is a {what} of an unknown format; the known ones are {names}")


def _size(path: Path) -> str:
    """Return the size of a large file, which may be the reason of an error."""
    size = 0 if path.is_dir() else path.stat().st_size
    return f", {size / 2**20:.0f} MiB," if size > LARGE else ""


def episodes(path: Path, rate: float | None = None) -> list[Episode]:
    """Return the movements in a file, at least one. `rate`: rate of samples without times, Hz. Raises Unreadable."""
    known = format_of(path)
    found = _reading(path, known, lambda reader: reader.episodes(path, rate))
    if not found:
        raise Unreadable(f"{path} has no joint positions; of the format {known.name} it needs {known.joints}")
    return found


def read(path: Path, episode: str | None = None, rate: float | None = None) -> Recording:
    """Return a movement of a file.

    Args:
        path: The file, or the directory of a data set or bag.
        episode: Name or number of the movement in the list of `episodes`, or last; optional for a single movement.
        rate: Rate of samples without times, Hz.

    Raises:
        Unreadable: the file cannot be read, has no such movement, or has several of which none was chosen.
    """
    chosen = choose(path, episodes(path, rate), episode)
    return _reading(path, format_of(path), lambda reader: reader.read(path, chosen.name, rate))


def choose(path: Path, found: Sequence[Episode], wanted: str | None) -> Episode:
    """Return the episode with a name or number, or the last. Raises Unreadable, which lists the episodes."""
    if wanted is None:
        if len(found) == 1:
            return found[0]
        raise Unreadable(f"{path} has {len(found)} episodes; choose one with --episode: {_listed(found)}")
    for episode in found:
        if episode.name == wanted:
            return episode
    if wanted.isdecimal() and int(wanted) < len(found):
        return found[int(wanted)]
    if wanted == "last":
        return found[-1]
    raise Unreadable(f"{path} has no episode {wanted!r}; it has {_listed(found)}")


def _listed(found: Sequence[Episode], most: int = 8) -> str:
    names = ", ".join(episode.name for episode in found[:most])
    return names if len(found) <= most else f"{names}, … {found[-1].name}"


def _reading(path: Path, known: Format, call: Callable[[Reader], T]) -> T:
    """Call a reader. Raises Unreadable for any error of its library, which means that the file is damaged."""
    reader = known.load(path)
    try:
        return call(reader)
    except Unreadable:
        raise
    # Each library raises its own errors for damaged files, among them KeyError, struct.error and RuntimeError.
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        cure = f"try {known.recovery}, or copy it again" if known.recovery else "copy or record it again"
        what = f"{path}{_size(path)} looks like {known.name} but is damaged or truncated"
        raise Unreadable(f"{what}: {cure} ({reason})") from None
