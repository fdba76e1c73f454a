"""`volley teach`: learn a movement from the guided arm, or from part of a trace."""

import os
import stat
import sys
from pathlib import Path

import numpy as np

from client import Refusal
from protocol.topics import PRIMITIVE_NAME
from robot.shipped import DEFAULT_ROBOT_CONFIG
from tools.recordings.learning import arranged, in_radians
from tools.recordings.recording import Recording, Unreadable
from tools.shell.flags import File, Name, Seconds, Switch
from tools.shell.guiding import guided
from tools.shell.reading import check_plot
from tools.shell.recordings import learnable
from tools.shell.shell import Shared, Shell, UsageError, reach


def teach(
    name: Name,
    *,
    seconds: Seconds = None,
    drag: Switch = False,
    robot_config: File = None,
    trace: File = None,
    begin: Seconds = None,
    end: Seconds = None,
    plot: File = None,
    play: Switch = False,
    replace: Switch = False,
    shell: Shared,
) -> int:
    """Learn a movement by guiding the arm, weightless and compliant, until Enter; or from part of a trace.

    The mouse (--drag) or `volley disturb` moves a simulated arm; a hand moves a real one. Rest at both ends is
    trimmed, and the recording is examined as by `volley learn`. Afterwards the arm holds its final pose.

    Args:
        name: Name of the new primitive.
        seconds: Duration of the recording, s of the robot's clock; by default until Enter.
        drag: Open a window in which the mouse drags the simulated arm; closing it also ends the recording.
        robot_config: With --drag: TOML file of the arm; by default the shipped one.
        trace: Learn from this .rrd file of the recorder; the arm does not move.
        begin: With --trace: start of the part, s of `sim_time` in Rerun's viewer; by default the trace's start.
        end: With --trace: end of the part, s; by default the trace's end.
        plot: Plot raw, fitted and imitated curves and the faults to a .png or .rrd file, before learning.
        play: Move the arm back to the start afterwards, and play the primitive once.
        replace: Overwrite a primitive of this name.
        shell: How to reach the robot.
    """
    if trace is None and (begin is not None or end is not None):
        raise UsageError("--begin and --end say which part of --trace FILE is taught")
    if trace is not None and (drag or seconds is not None):
        raise UsageError("--trace FILE is cut by --begin and --end; --drag and --seconds are for an arm that is guided")
    if robot_config is not None and not drag:
        raise UsageError(
            f"--robot-config {robot_config} is the arm that --drag shows; give --drag too, or leave it out"
        )
    if seconds is not None and not 0 < seconds < np.inf:
        raise UsageError(f"--seconds is {seconds:g}; it must be a number greater than 0")
    if trace is None and seconds is None and not drag and _stdin_is_empty():
        raise UsageError("nobody can press Enter, because standard input is empty; give --seconds DURATION")
    if begin is not None and end is not None and not begin < end:
        raise UsageError(f"--begin {begin:g} is not before --end {end:g}")
    check_plot(plot, [trace] if trace else ())
    with reach(shell) as link:
        _check_name(link, name, replace)
        try:
            if trace is None:
                raw = guided(link, name, seconds, (robot_config or DEFAULT_ROBOT_CONFIG) if drag else None)
            else:
                raw = _cut(trace, begin, end, link.joint_names())
            recording = in_radians(learnable([raw], link.description(), plot).recording)
        except Unreadable as problem:
            raise UsageError(str(problem)) from None
        learned = link.arm.learn(
            name,
            recording.values,
            times=recording.times.tolist(),
            joint_names=link.joint_names() or None,
            replace=replace,
        )
        link.print(learned)
        if not play or learned.start is None:
            return 0
        back = link.follow(link.arm.goal(name, positions=learned.start.positions))
        return back or link.follow(link.arm.goal(name))


def _stdin_is_empty() -> bool:
    """Return whether standard input is closed or a device without lines, as in a program that has no terminal.

    A pipe is not empty: its lines, or its end, end the recording.
    """
    if sys.stdin is None or sys.stdin.closed:
        return True
    try:
        return stat.S_ISCHR(os.fstat(sys.stdin.fileno()).st_mode) and not sys.stdin.isatty()
    except OSError:
        return False  # a test, or a program, has replaced it


def _check_name(link: Shell, name: str, replace: bool) -> None:
    """Refuse what the planner would refuse once the arm has been guided, and the movement be lost."""
    if not PRIMITIVE_NAME.fullmatch(name):
        raise UsageError(f"NAME {name!r} must be 1 to 64 letters, digits, - or _, not starting with - or _")
    if not replace and name in (primitive.name for primitive in link.arm.primitives()):
        sentence = f"there is a primitive {name!r}; take another name, or overwrite it with --replace"
        raise Refusal("exists", sentence, name=name)


def _cut(trace: Path, begin: float | None, end: float | None, joints: list[str]) -> Recording:
    """Return the measured positions between two times of a trace."""
    from tools.recordings.readers import rrd  # slow to import

    part = rrd.cut(trace, -np.inf if begin is None else begin, np.inf if end is None else end)
    return arranged(part, joints, {})
