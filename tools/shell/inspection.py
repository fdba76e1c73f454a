"""`volley inspect`: faults of a recording, and a plot of what would be learned from it."""

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
from tools.shell.flags import File, Number, RobotConfigFile, Seconds, Source
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
    robot_config: RobotConfigFile = DEFAULT_ROBOT_CONFIG,
    plot: File = None,
) -> None:
    """Report the faults of a recording, and which of them `volley learn` repairs, without learning it.

    Args:
        file: The recording, or the directory of a data set or bag.
        episode: Name or number of the movement, as `volley episodes` lists them.
        map: Column and joint, THEIRS=OURS, for a column that is not named like its joint; `*` matches any text.
        unit: Unit of the angles, if the file does not give it.
        rate: Samples per second, for a file without times or with wrong ones.
        duration: Scale the times to this total, s; for recordings over a phase from 0 to 1.
        calibration: LeRobot calibration (.json) of the arm that recorded positions of -100 to 100.
        robot_config: TOML file of the arm that will play it; by default the shipped one.
        plot: Plot raw, fitted and imitated curves and the faults to a .png or .rrd file.
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
        print("no faults found")
