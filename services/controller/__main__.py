"""`python -m services.controller`: track trajectories at 1 kHz."""

from dataclasses import dataclass, field

import tyro

from protocol.bus.bus import Bus
from services.common import realtime
from services.common.cli import Common, Options
from services.common.logs import start_logging
from services.common.signals import stop_on_signals
from services.common.single_instance import Outcome, SingleInstance
from services.common.startup import load_configured
from services.controller.handshake import WrongRobot
from services.controller.loop import ControllerLoop


@dataclass(frozen=True, slots=True)
class Flags:
    """Track trajectories at 1 kHz: answer every state of the arm with a command."""

    common: Common = field(default_factory=Options)


def main() -> None:
    """Run until SIGTERM or Ctrl-C, and exit with the `Outcome`; it is FAILED also for an unexpected arm."""
    flags = tyro.cli(Flags)
    log = start_logging("controller", flags.common.log)
    stopping = stop_on_signals()
    config = load_configured(flags.common, log)
    loops, others = realtime.split_cores(flags.common.loop_core)
    for missing in realtime.keep_to(loops) + realtime.become_real_time(priority=50):
        log.warning("without %s: ticks may come late", missing)

    def serve(bus: Bus) -> None:
        loop = ControllerLoop(bus, config, log)
        realtime.keep_to(others)  # `open` starts threads that receive requests and check trajectories
        loop.open()
        realtime.keep_to(loops)
        realtime.freeze_garbage()
        try:
            loop.run(stopping)
        except WrongRobot as error:
            log.error("%s", error)
            raise SystemExit(Outcome.FAILED) from None
        finally:
            loop.close()

    raise SystemExit(SingleInstance("controller", flags.common, config.name, log).run(serve, stopping))


if __name__ == "__main__":
    main()
