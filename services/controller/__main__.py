"""`python -m services.controller`: track trajectories at 1 kHz."""

from dataclasses import dataclass, field

import tyro

from robot.description import load_robot
from services.common import realtime
from services.common.cli import Common, Options
from services.common.logs import start_logging
from services.common.single_instance import service_bus
from services.controller.loop import ControllerLoop, WrongRobot


@dataclass(frozen=True, slots=True)
class Flags:
    """Track trajectories at 1 kHz: answer every state of the arm with a command."""

    common: Common = field(default_factory=Options)


def main() -> None:
    """Run until SIGTERM or Ctrl-C."""
    flags = tyro.cli(Flags)
    log = start_logging("controller", flags.common.log)
    stopping = realtime.stop_on_signals()
    config = load_robot(flags.common.robot_config)
    loops, others = realtime.split_cores(flags.common.loop_core)
    for missing in realtime.keep_to(loops) + realtime.become_real_time(priority=50):
        log.warning("without %s: ticks may come late", missing)
    with service_bus("controller", flags.common, config.name, stopping, log) as bus:
        loop = ControllerLoop(bus, config, log)
        realtime.keep_to(others)  # what `open` starts: threads that take requests and check trajectories
        loop.open()
        realtime.keep_to(loops)
        realtime.freeze_garbage()
        try:
            loop.run(stopping)
        except WrongRobot as error:
            log.error("%s", error)
            raise SystemExit(1) from None
        finally:
            loop.close()


if __name__ == "__main__":
    main()
