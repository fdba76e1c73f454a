"""`python -m services.controller`: track trajectories at 1 kHz."""

import sys
from dataclasses import dataclass, field

import tyro

from services import runtime
from services.controller.loop import ControllerLoop, WrongRobot
from services.options import Common, Options, open_bus
from services.robot import load_robot


@dataclass(frozen=True, slots=True)
class Flags:
    """Track trajectories at 1 kHz: answer every state of the arm with a command."""

    common: Common = field(default_factory=Options)


def main() -> int:
    """Run until SIGTERM or Ctrl-C; return the exit status."""
    flags = tyro.cli(Flags)
    log = runtime.start_logging("controller")
    stopping = runtime.stop_on_signals()
    config = load_robot(flags.common.robot_config)
    for missing in runtime.become_real_time(priority=40):
        log.warning("without %s: ticks may come late", missing)
    with open_bus(flags.common, config.name) as bus:
        if not bus.claim("controller"):
            log.error("another controller serves robot %s on this bus", bus.robot)
            return runtime.EXIT_TAKEN
        loop = ControllerLoop(bus, config, log)
        loop.open()
        runtime.freeze_garbage()
        try:
            loop.run(stopping)
        except WrongRobot as error:
            log.error("%s", error)
            return 1
        finally:
            loop.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
