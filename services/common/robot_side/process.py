"""The process around a robot's loop."""

import logging
from collections.abc import Callable, Sequence

from protocol.bus.bus import Bus
from protocol.messages import Clock
from protocol.topics import ROBOT_SIDE
from robot.description import RobotConfig
from services.common import realtime
from services.common.cli import Options
from services.common.logs import start_logging
from services.common.robot_side.backend import RobotFailed
from services.common.robot_side.clocks import keep_time
from services.common.robot_side.loop import RobotLoop
from services.common.signals import stop_on_signals
from services.common.single_instance import Outcome, SingleInstance
from services.common.startup import load_configured

PRIORITY = 40
"""Priority under SCHED_FIFO; the controller's is higher, so a flood of messages delays a step, but no command."""

Build = Callable[[Bus, RobotConfig, logging.Logger], Sequence[RobotLoop]]


def run_robot(
    name: str,
    options: Options,
    clock: Clock,
    build: Build,
    keep: Callable = keep_time,
    other_robots: Sequence[str] = (),
) -> Outcome:
    """Run the robot side of a bus, which this process hosts unless --connect is given, until SIGTERM or Ctrl-C.

    name: in the log. build: makes the loops, one a robot, after their names on the bus are claimed. keep: runs the
    loops by a clock. other_robots: names of further robots of this process.
    """
    log = start_logging(name, options.log)
    stopping = stop_on_signals()
    config = load_configured(options, log)
    loops, others = realtime.split_cores(options.loop_core)
    _prioritise(loops, clock, log)

    def serve(bus: Bus) -> None:
        arms = build(bus, config, log)
        realtime.keep_to(others)  # `open` starts threads that receive requests
        for arm in arms:
            arm.open()
        realtime.keep_to(loops)
        log.info("robot %s, %s clock", " and ".join([bus.robot, *other_robots]), clock)
        realtime.freeze_garbage()
        try:
            keep(arms, stopping)
        finally:
            for arm in arms:
                arm.backend.close()

    try:
        return SingleInstance(ROBOT_SIDE, options, config.name, log, hosts=True, other_robots=other_robots).run(
            serve, stopping
        )
    except RobotFailed as failed:
        log.error("%s", failed)
        return Outcome.FAILED


def _prioritise(cores: set[int], clock: Clock, log: logging.Logger) -> None:
    """Restrict this process to `cores`, with the priority that its clock needs; log what is not granted."""
    missing = realtime.keep_to(cores)
    if clock == "realtime":
        missing += realtime.become_real_time(PRIORITY)
    elif clock == "paced":
        realtime.become_steady()
    for sentence in missing:
        log.warning("without %s: ticks may come late", sentence)
