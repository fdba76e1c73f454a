"""The result of every reader: joint positions over time, as in the file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

Unit = Literal["rad", "deg"]

HEAD_BYTES = 4096

MAX_SAMPLES = 1_000_000
"""Largest number of samples of an episode that are read."""


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """One movement of one file.

    Attributes:
        times: (n,) s, from the file or from a rate; n may be 0, and they need not rise.
        columns: Names of the C columns in the file; () without names.
        values: (n, C) float64 in `unit`, not finite for missing numbers.
        unit: Unit of the values; None if the file does not give it.
        source: The file, or the directory of a data set.
        episode: Name in the file, as `volley episodes` lists it.
        stamped: Whether the file has a time for each sample; False: `times` are computed from a rate.
        notes: Sentences about the reader's assumptions.
        normalised: Whether values without a unit may be in per cent of ranges, -100 to 100, as LeRobot records them.
    """

    times: np.ndarray
    columns: tuple[str, ...]
    values: np.ndarray
    unit: Unit | None
    source: Path
    episode: str
    stamped: bool
    notes: tuple[str, ...] = ()
    normalised: bool = False


@dataclass(frozen=True, slots=True)
class Episode:
    """One movement of a file. `duration`, s, is None if the file has neither times nor a rate."""

    name: str
    samples: int
    duration: float | None


class Unreadable(Exception):
    """The file has no usable recording; `str()` is one sentence that names the file and the cure."""


def head(path: Path) -> bytes:
    """Return the first bytes of a file, which identify its format; empty for a directory."""
    if path.is_dir():
        return b""
    with path.open("rb") as file:
        return file.read(HEAD_BYTES)


def check_size(source: Path, episode: str, samples: int) -> None:
    """Raise Unreadable if an episode has too many samples."""
    if samples > MAX_SAMPLES:
        raise Unreadable(
            f"{source}: {episode} has {samples} samples; at most {MAX_SAMPLES} are read, so cut it or keep every nth"
        )
