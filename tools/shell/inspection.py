"""`volley inspect`: what the doctor says of a recording, and a picture of what it would become."""

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from motion.errors import InvalidMotion
from robot.description import RobotError, load_robot
from robot.recordings.plausibility import beyond_limits
from robot.shipped import DEFAULT_ROBOT_CONFIG
from tools.recordings.doctor import Finding, examine
from tools.recordings.learning import load
from tools.recordings.pictures import picture
from tools.recordings.preview import preview
from tools.recordings.recording import Unit, Unreadable
from tools.shell.flags import File, Number, Seconds, Source
from tools.shell.recordings import Chosen, Maps, check_plot, check_times, mapping, print_findings
from tools.shell.shell import UsageError


def inspect(
    file: Source,
    *,
    episode: Chosen = None,
    map: Maps = (),
    unit: Annotated[Unit | None, arg(help_behavior_hint="")] = None,
    rate: Number = None,
    duration: Seconds = None,
    calibration: File = None,
    robot_config: Annotated[Path, arg(metavar="FILE", help_behavior_hint="")] = DEFAULT_ROBOT_CONFIG,
    plot: File = None,
) -> None:
    """Say what is wrong with a recording, and what `volley learn` repairs; nothing is learned.

    Args:
        file: The recording, or the directory of a data set or bag.
        episode: Which of several movements, by name or number, as `volley episodes` lists them.
        map: A column and the joint that it is, for every column whose name differs; `*` stands for any text.
        unit: Of the angles, where the file does not say it.
        rate: Samples per second, of a file without times.
        duration: Stretch the times to last this long, s; for recordings against a phase from 0 to 1.
        calibration: LeRobot's of the arm that recorded positions of -100 to 100, a .json file.
        robot_config: TOML file of the arm that shall play it; by default the shipped one.
        plot: Draw raw, fitted and imitated curves with the findings marked, into a .png or .rrd file.
    """
    check_times(rate, duration)
    check_plot(plot, [file])
    try:
        robot = load_robot(robot_config)
        raw = load(
            file,
            robot.joint_names,
            episode=episode,
            mapping=mapping(map),
            unit=unit,
            rate=rate,
            duration=duration,
            calibration=calibration,
        )
        examination = examine(raw, robot)
        print_findings(raw.notes, examination.findings, stderr=False)
        if refusal := examination.refusal:
            raise UsageError(f"{file} cannot be learned: {refusal.sentence}")
        shown = preview(raw, examination, robot)
        slower = [Finding(said) for said in beyond_limits(shown.primitive, robot.limits, robot.joint_names)]
        print_findings((), slower, stderr=False)
        if plot is not None:
            picture(shown, plot)
            print(f"wrote {plot}")
    except (RobotError, Unreadable, InvalidMotion) as problem:
        raise UsageError(str(problem)) from None
    if not examination.findings and not slower:
        print("nothing is wrong with it")
