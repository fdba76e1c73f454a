"""`volley learn`, `episodes` and `export`: learn from recordings, and write played motions to files."""

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from rich.text import Text
from tyro.conf import Positional, arg

from motion.demonstration import SavitzkyGolay
from motion.errors import InvalidMotion
from protocol import messages as m
from robot.conversions import limits_of
from tools.recordings import readers, writers
from tools.recordings.doctor import Arm, Finding, examine
from tools.recordings.learning import in_radians
from tools.recordings.recording import Recording, Unreadable
from tools.shell.console import ShellConsole
from tools.shell.flags import File, Number, Seconds, Source, Switch
from tools.shell.reading import Reading, check_plot, check_times
from tools.shell.shell import Flags, Shared, UsageError, reach
from tools.shell.tables import cell, table

Sources = Positional[Annotated[tuple[Path, ...], arg(metavar="FILE ...", help_behavior_hint="")]]
Named = Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")]


def learn(
    files: Sources,
    *,
    name: Named = None,
    reading: Reading,
    smoothing: Annotated[Literal["auto", "none"] | None, arg(help_behavior_hint="")] = None,
    window: Seconds = None,
    order: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
    follow_spread: Switch = False,
    replace: Switch = False,
    plot: File = None,
    shell: Shared,
) -> None:
    """Learn a primitive from a recording: CSV, NPZ, HDF5, LeRobot, ROS bag, MCAP or Rerun.

    Columns are matched to joints by name. Several files must be recordings of one movement; their mean is learned.
    Prints assumptions, repairs, warnings, the error of the learned movement against its samples, and its start and
    end. docs/recordings.md describes each format.

    Args:
        files: The recording, or the directory of a data set or bag; several are learned together.
        name: Name of the new primitive; by default the first file's name without its extension.
        reading: How the recording is read.
        smoothing: auto (default) fits a penalised spline, smoothed for each joint; none follows every sample.
        window: Smooth with a Savitzky-Golay filter of this width instead, s, as the paper does.
        order: With --window: polynomial order of that filter; by default 5.
        follow_spread: With several recordings: keep motions close where the recordings agree, and free elsewhere.
        replace: Overwrite a primitive of this name.
        plot: Plot raw, fitted and imitated curves and the faults to a .png or .rrd file, before learning.
        shell: How to reach the robot.
    """
    reading.check()
    check_plot(plot, files)
    if not files:
        raise UsageError("learn needs a FILE, or several of one movement; see volley learn --help")
    several = len(files) > 1
    if plot is not None and several:
        raise UsageError(
            f"--plot draws one recording; learn has {len(files)} files: volley inspect FILE --plot {plot} draws each"
        )
    if follow_spread and not several:
        raise UsageError("--follow-spread needs several recordings of one movement; name more files")
    filtered = _filter(smoothing, window, order)
    with reach(shell) as link:
        joints = link.joint_names()
        try:
            raws = [reading.load(file, joints) for file in files]
            lesson = learnable(raws, link.description(), plot, filtered)
            recording = in_radians(lesson.recording)
        except (Unreadable, InvalidMotion) as problem:
            raise UsageError(str(problem)) from None
        learned = link.arm.learn(
            name or primitive_name(files[0]),
            recording.values,
            times=recording.times.tolist(),
            joint_names=joints or None,
            smoothing=filtered,
            replace=replace,
            spread=lesson.spread if follow_spread else None,
        )
        link.print(learned)
        if learned.start:
            print_findings((way_to_begin(learned.name, learned.start.positions, shell),), ())


def episodes(file: Source, *, rate: Number = None) -> None:
    """List the movements of a recording: episodes of a data set, topics of a bag, goals of a trace.

    Args:
        file: The recording, or the directory of a data set or bag.
        rate: Samples per second, for a file without times or with wrong ones.
    """
    check_times(rate)
    try:
        found = readers.episodes(file, rate)
    except Unreadable as problem:
        raise UsageError(str(problem)) from None
    listed = table(("episode", "samples", "duration [s]"), str(file))
    for one in found:
        listed.add_row(one.name, cell(one.samples), cell(one.duration))
    ShellConsole().print(listed)


def export(
    goal: Positional[Annotated[str, arg(metavar="ID|last")]],
    *,
    trace: Annotated[Path, arg(metavar="FILE.rrd")],
    output: Annotated[Path, arg(metavar="OUT", aliases=["-o"])],
) -> None:
    """Write the measured positions of a played motion from a trace to a file for other programs.

    Args:
        goal: The motion, as `volley episodes` lists them, or last.
        trace: Trace (.rrd) of the recorder.
        output: A .csv, .npz or .mcap file, or a new directory for a LeRobot data set.
    """
    from tools.recordings.readers.rrd import check_trace  # slow to import

    try:
        check_trace(trace)
        recording = readers.read(trace, goal)
        writers.write(recording, output)
    except Unreadable as problem:
        raise UsageError(str(problem)) from None
    ShellConsole().print(
        f"wrote {output}: {recording.episode}, {len(recording.times)} samples, {recording.times[-1]:.3f} s"
    )


def way_to_begin(name: str, positions: Sequence[float], flags: Flags) -> str:
    """Return a sentence with the commands that move an arm to the start of a primitive, `positions` (J,), rad."""
    begin = " ".join(f"{round(value, 6) + 0.0:.6f}" for value in positions) + flags.way
    return (
        f"to play it as recorded, first bring the arm to its start: volley goal {name} --wait --positions {begin}, or "
        f"for a simulated arm volley reset-sim --positions {begin}"
    )


def primitive_name(file: Path) -> str:
    """Return a library name made from a file's name, with - for characters that are not allowed."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", file.resolve().stem).strip("-_")[:64] or "recording"


def _filter(
    smoothing: Literal["auto", "none"] | None, window: float | None, order: int | None
) -> Literal["auto", "none"] | m.SavitzkyGolay:
    """Return the smoothing that the flags ask for.

    Raises:
        UsageError: a flag would have no effect.
    """
    if window is None:
        if order is not None:
            raise UsageError(f"--order {order} is that of the filter of --window; give --window too, or leave it out")
        return smoothing or "auto"
    if smoothing is not None:
        raise UsageError(f"--smoothing {smoothing} and --window {window:g} both set the smoothing; give one of them")
    return m.SavitzkyGolay(window_s=window, order=5 if order is None else order)


class Learnable(NamedTuple):
    """The recording to learn; of several recordings their mean, and their spread (n, J), rad, at even phases."""

    recording: Recording
    spread: np.ndarray | None = None


def learnable(
    raws: Sequence[Recording],
    description: m.Description | None,
    plot: Path | None,
    smoothing: Literal["auto", "none"] | m.SavitzkyGolay = "auto",
) -> Learnable:
    """Return the repaired recording, or the mean of several repaired recordings. `smoothing` is that of the plot.

    Raises:
        Unreadable: a recording cannot be learned.
        InvalidMotion: the smoothing does not fit the recording.
    """
    arm = _arm(description)
    examinations = [examine(raw, arm) for raw in raws]
    for raw, examination in zip(raws, examinations, strict=True):
        print(summary(raw), file=sys.stderr)
        print_findings(raw.notes, [finding for finding in examination.findings if not finding.planner_warns])
        if refusal := examination.refusal:
            raise Unreadable(f"{raw.source} cannot be learned: {refusal.sentence}")
    if plot is not None:  # the plotting module is slow to import
        from tools.recordings.pictures import picture
        from tools.recordings.preview import preview

        fit = (
            SavitzkyGolay(smoothing.window_s, smoothing.order) if isinstance(smoothing, m.SavitzkyGolay) else smoothing
        )
        picture(preview(raws[0], examinations[0], arm, fit), plot)
    if len(examinations) == 1:
        return Learnable(examinations[0].recording)
    from tools.recordings.several import combine

    together = combine([examination.recording for examination in examinations])
    doubt = together.doubt()
    print_findings((together.sentence(),), [Finding(doubt)] if doubt else ())
    return Learnable(together.mean, together.weighting())


def _arm(description: m.Description | None) -> Arm | None:
    """Return the arm that will play a recording, or None without a description."""
    if description is None:
        return None
    return Arm(tuple(description.joint_names), limits_of(description.limits))


def summary(raw: Recording) -> str:
    """Return a line with the name, number of samples and duration of a recording."""
    length = float(np.ptp(raw.times)) if len(raw.times) else 0.0
    return f"{raw.source}: {raw.episode}, {len(raw.times)} samples, {length:.3f} s"


def print_findings(notes: Sequence[str], findings: Sequence[Finding], stderr: bool = True) -> None:
    """Print a line for each assumption, repair and remaining fault; to stderr beside a reply, which may be JSON."""
    console = ShellConsole(stderr=stderr, soft_wrap=True)
    for note in notes:
        console.print(Text.assemble(("note: ", "dim"), note))
    for finding in findings:
        if finding.fatal:  # the refusal names it
            continue
        state = ("repaired: ", "green") if finding.repaired else ("look: ", "yellow")
        console.print(Text.assemble(state, finding.sentence))
