"""`volley learn`, `episodes` and `export`: recordings into the library, and played motions into files."""

import re
import sys
from pathlib import Path
from typing import Annotated, Literal

from rich.console import Console
from tyro.conf import Positional, UseAppendAction, arg

from protocol import messages as m
from tools.recordings import readers, writers
from tools.recordings.learning import in_radians, load
from tools.recordings.recording import Recording, Unit, Unreadable
from tools.shell.flags import Number, Seconds, Source, Switch
from tools.shell.shell import Shared, UsageError, reach
from tools.shell.show import cell, table

Maps = UseAppendAction[Annotated[tuple[str, ...], arg(metavar="THEIRS=OURS")]]
Chosen = Annotated[str | None, arg(metavar="N", help_behavior_hint="")]
Named = Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")]


def learn(
    file: Source,
    *,
    name: Named = None,
    episode: Chosen = None,
    map: Maps = (),
    unit: Annotated[Unit | None, arg(help_behavior_hint="")] = None,
    rate: Number = None,
    duration: Seconds = None,
    smoothing: Literal["auto", "none"] = "auto",
    window: Seconds = None,
    order: Annotated[int, arg(metavar="N")] = 5,
    replace: Switch = False,
    shell: Shared,
) -> None:
    """Learn a primitive from a recording: CSV, NPZ, HDF5, LeRobot, ROS bag, MCAP or Rerun.

    Joints are found by their names. Prints what was assumed, how far the learned movement is from its samples, where it
    begins and ends, and warnings about the recording. docs/recordings.md describes each format.

    Args:
        file: The recording, or the directory of a data set or bag.
        name: Of the new primitive; by default the file's name without its ending.
        episode: Which of several movements, by name or number, as `volley episodes` lists them.
        map: A column and the joint that it is, for every column whose name differs; `*` stands for any text.
        unit: Of the angles, where the file does not say it.
        rate: Samples per second, of a file without times.
        duration: Stretch the times to last this long, s; for recordings against a phase from 0 to 1.
        smoothing: auto fits a penalised spline, each joint smoothed as its noise asks for; none follows every sample.
        window: Smooth with a Savitzky-Golay filter this long, s, instead, as the paper does.
        order: Of that filter's polynomial.
        replace: Overwrite a primitive of this name.
        shell: How to reach the robot.
    """
    if rate is not None and duration is not None:
        raise UsageError("--rate and --duration say the same thing twice; give one of them")
    filtered = m.SavitzkyGolay(window_s=window, order=order) if window is not None else smoothing
    with reach(shell) as link:
        joints = link.joint_names()
        try:
            recording = in_radians(
                load(
                    file,
                    joints,
                    episode=episode,
                    mapping=mapping(map),
                    unit=unit,
                    rate=rate,
                    duration=duration,
                )
            )
        except Unreadable as problem:
            raise UsageError(str(problem)) from None
        _print_notes(recording)
        learned = link.arm.learn(
            name or primitive_name(file),
            recording.values,
            times=recording.times.tolist(),
            joint_names=joints or None,
            smoothing=filtered,
            replace=replace,
        )
        link.print(learned)


def episodes(file: Source, *, rate: Number = None) -> None:
    """List the movements of a recording: episodes of a data set, topics of a bag, goals of a trace.

    Args:
        file: The recording, or the directory of a data set or bag.
        rate: Samples per second, of a file without times.
    """
    try:
        found = readers.episodes(file, rate)
    except Unreadable as problem:
        raise UsageError(str(problem)) from None
    listed = table(("episode", "samples", "duration [s]"), str(file))
    for one in found:
        listed.add_row(one.name, cell(one.samples), cell(one.duration))
    Console().print(listed)


def export(
    goal: Positional[Annotated[str, arg(metavar="ID|last")]],
    *,
    trace: Annotated[Path, arg(metavar="FILE.rrd")],
    output: Annotated[Path, arg(metavar="OUT", aliases=["-o"])],
) -> None:
    """Write a motion that was played, as the arm measured it, from a trace into a file for other programs.

    Args:
        goal: Which motion, as `volley episodes` lists them, or last.
        trace: What the recorder wrote.
        output: A file that ends in .csv, .npz or .mcap, or a new directory for a LeRobot data set.
    """
    try:
        chosen = readers.episodes(trace)[-1].name if goal == "last" else goal
        recording = readers.read(trace, chosen)
        writers.write(recording, output)
    except Unreadable as problem:
        raise UsageError(str(problem)) from None
    Console().print(f"wrote {output}: {chosen}, {len(recording.times)} samples, {recording.times[-1]:.3f} s")


def primitive_name(file: Path) -> str:
    """Return a name for the library from a file's, with - for what a name cannot have."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", file.resolve().stem).strip("-_")[:64] or "recording"


def mapping(pairs: tuple[str, ...]) -> dict[str, str]:
    """Return the columns and joints of --map. Raises UsageError."""
    split = [pair.partition("=") for pair in pairs]
    for pair, (theirs, _, ours) in zip(pairs, split, strict=True):
        if not theirs or not ours or theirs.count("*") > 1 or ours.count("*") > theirs.count("*"):
            raise UsageError(f"--map {pair}: write THEIRS=OURS, a column and a joint, each with one * at most")
    return {theirs: ours for theirs, _, ours in split}


def _print_notes(recording: Recording) -> None:
    """Print to stderr, so that --json stays one line of JSON."""
    length = recording.times[-1] - recording.times[0]
    print(f"{recording.source}: {recording.episode}, {len(recording.times)} samples, {length:.3f} s", file=sys.stderr)
    for note in recording.notes:
        print(f"note: {note}", file=sys.stderr)
