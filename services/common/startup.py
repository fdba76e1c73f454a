"""Start-up of a service: log, signals, cores, robot config."""

import logging
import threading

from protocol.topics import check_robot_name
from robot.description import RobotConfig, load_robot
from services.common import realtime
from services.common.cli import MISUSED, Options
from services.common.logs import start_logging
from services.common.signals import stop_on_signals


def start_beside_loops(name: str, options: Options) -> tuple[logging.Logger, threading.Event, RobotConfig]:
    """Start a service that stays off the core of the loops.

    Returns its logger, an event that is set when it must end, and the robot.

    Raises:
        SystemExit: the description or the name on the bus is invalid; the log has the reason.
    """
    log = start_logging(name, options.log)
    stopping = stop_on_signals()
    _, others = realtime.split_cores(options.loop_core)
    realtime.keep_to(others)
    return log, stopping, load_configured(options, log)


def load_configured(options: Options, log: logging.Logger) -> RobotConfig:
    """Return the robot that `options` name.

    Raises:
        SystemExit: the description or the name on the bus is invalid; the log has the reason.
    """
    try:
        if options.robot is not None:
            check_robot_name(options.robot)
        return load_robot(options.robot_config)
    except ValueError as error:
        log.error("%s", error)
        raise SystemExit(MISUSED) from None
