"""How a recording is read: flags that several commands have."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import UseAppendAction, arg

from tools.recordings.learning import load
from tools.recordings.recording import Recording, Unit
from tools.shell.flags import File, Number, Seconds
from tools.shell.shell import UsageError

Maps = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="THEIRS=OURS")]]
Chosen = Annotated[str | None, arg(metavar="N", help_behavior_hint="")]


@dataclass(frozen=True, slots=True)
class ReadingFlags:
    """How a recording is read.

    Attributes:
        episode: Name or number of the movement, as `volley episodes` lists them, or last.
        map: Column and joint, THEIRS=OURS, for a column that is not named like its joint; `*` matches any text.
        unit: Unit of the angles, if the file does not give it.
        rate: Samples per second, for a file without times or with wrong ones.
        duration: Scale the times to this total, s; for recordings over a phase from 0 to 1.
        calibration: LeRobot calibration (.json) of the arm that recorded positions of -100 to 100.
    """

    episode: Chosen = None
    map: Maps = ()
    unit: Annotated[Unit | None, arg(help_behavior_hint="")] = None
    rate: Number = None
    duration: Seconds = None
    calibration: File = None

    def check(self) -> None:
        """Raise UsageError for flags that contradict each other."""
        check_times(self.rate, self.duration)
        mapping(self.map)

    def load(self, file: Path, joints: Sequence[str]) -> Recording:
        """Return the recording in `file`, with columns in the order of `joints`.

        Raises:
            Unreadable: the file has no such recording.
        """
        given = asdict(self)
        return load(file, joints, mapping=mapping(given.pop("map")), **given)


Reading = Annotated[ReadingFlags, arg(name="")]


def check_times(rate: float | None, duration: float | None = None) -> None:
    """Raise UsageError for times that no recording has."""
    if rate is not None and duration is not None:
        raise UsageError("--rate and --duration both set the times; give one of them")
    for flag, value in (("--rate", rate), ("--duration", duration)):
        if value is not None and not 0 < value < math.inf:
            raise UsageError(f"{flag} is {value:g}; it must be a number greater than 0")


def check_plot(plot: Path | None, files: Sequence[Path] = ()) -> None:
    """Raise UsageError for a picture that cannot be drawn, before anything else is done."""
    if plot is None:
        return
    if plot.suffix not in (".png", ".rrd"):
        raise UsageError(f"--plot {plot}: the file must end in .png, or in .rrd for the Rerun viewer")
    if not plot.parent.is_dir():
        raise UsageError(f"--plot {plot}: there is no directory {plot.parent}; make it, or name another file")
    if plot.exists() and any(file.exists() and plot.samefile(file) for file in files):
        raise UsageError(f"--plot {plot} would overwrite the recording; name another file")


def mapping(pairs: tuple[str, ...]) -> dict[str, str]:
    """Return the joint of each column in --map.

    Raises:
        UsageError: a pair has another form.
    """
    split = [pair.partition("=") for pair in pairs]
    for pair, (theirs, _, ours) in zip(pairs, split, strict=True):
        if not theirs or not ours or theirs.count("*") > 1 or ours.count("*") > theirs.count("*"):
            raise UsageError(f"--map {pair}: write THEIRS=OURS, a column and a joint, each with at most one *")
    found = {theirs: ours for theirs, _, ours in split}
    for theirs, _, ours in split:
        if (other := found[theirs]) != ours:
            raise UsageError(f"--map {theirs}={ours}: {theirs!r} is also mapped to {other!r}; give one of the two")
    return found
