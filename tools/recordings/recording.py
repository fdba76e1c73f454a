"""What every reader returns: joint positions over time, as the file has them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

Unit = Literal["rad", "deg"]

HEAD_BYTES = 4096

MAX_SAMPLES = 1_000_000
"""Samples of one episode that are read into memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """One movement of one file.

    Attributes:
        times: (n,) s, as the file has them, or made from a rate; n may be 0, and they may not rise.
        columns: Names of the C columns, as the file has them; () where it names none.
        values: (n, C) float64 in `unit`, not finite where the file has no number.
        unit: Of the values; None where the file does not say.
        source: The file, or the directory of a data set.
        episode: Its name in the file, as `volley episodes` lists it.
        stamped: Whether the file has a time for each sample; False: `times` are made from a rate.
        notes: Sentences on what the reader assumed.
        normalised: Whether values without a unit may be parts of ranges, -100 to 100, as in LeRobot's recordings.
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
    """One movement that a file has. `duration`, s, is None where the file has no times and no rate."""

    name: str
    samples: int
    duration: float | None


class Unreadable(Exception):
    """A file without a usable recording; `str()` is one sentence that names the file and says what to do."""


def head(path: Path) -> bytes:
    """Return the first bytes of a file, by which formats are recognised; none of a directory."""
    if path.is_dir():
        return b""
    with path.open("rb") as file:
        return file.read(HEAD_BYTES)


def check_size(source: Path, episode: str, samples: int) -> None:
    """Raise Unreadable where an episode has more samples than are read into memory."""
    if samples > MAX_SAMPLES:
        raise Unreadable(
            f"{source}: {episode} has {samples} samples; at most {MAX_SAMPLES} are read, so cut it or keep every nth"
        )
