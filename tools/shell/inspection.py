"""`volley inspect`: faults of a recording, and a plot of what would be learned from it."""

from motion.errors import InvalidMotion
from robot.description import RobotError, load_robot
from robot.recordings.plausibility import beyond_limits
from robot.shipped import DEFAULT_ROBOT_CONFIG
from tools.recordings.doctor import Finding, examine
from tools.recordings.pictures import picture
from tools.recordings.preview import preview
from tools.recordings.recording import Unreadable
from tools.shell.flags import File, RobotConfigFile, Source
from tools.shell.reading import Reading, check_plot
from tools.shell.recordings import print_findings, summary
from tools.shell.shell import UsageError


def inspect(
    file: Source,
    *,
    reading: Reading,
    robot_config: RobotConfigFile = DEFAULT_ROBOT_CONFIG,
    plot: File = None,
) -> None:
    """Report the faults of a recording, and which of them `volley learn` repairs, without learning it.

    Args:
        file: The recording, or the directory of a data set or bag.
        reading: How the recording is read.
        robot_config: TOML file of the arm that will play it; by default the shipped one.
        plot: Plot raw, fitted and imitated curves and the faults to a .png or .rrd file.
    """
    reading.check()
    check_plot(plot, [file])
    try:
        robot = load_robot(robot_config)
        raw = reading.load(file, robot.joint_names)
        examination = examine(raw, robot)
        print(summary(raw))
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
