"""The robot config of a service, or the end of the service where it cannot be used."""

import logging

from protocol.topics import check_robot_name
from robot.description import RobotConfig, load_robot
from services.common.cli import MISUSED, Options


def load_configured(options: Options, log: logging.Logger) -> RobotConfig:
    """Return the robot that `options` name.

    Raises:
        SystemExit: the description or the name on the bus cannot be used; the log says why.
    """
    try:
        if options.robot is not None:
            check_robot_name(options.robot)
        return load_robot(options.robot_config)
    except ValueError as error:
        log.error("%s", error)
        raise SystemExit(MISUSED) from None
