"""`python -m services.sim`: the simulated arm, which hosts the bus unless told otherwise."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from robot.description import load_robot
from services.common import realtime
from services.common.cli import Common, Options, SimFlags
from services.common.logs import start_logging
from services.common.single_instance import service_bus
from services.sim.arm import Diverged
from services.sim.loop import SimLoop


@dataclass(frozen=True, slots=True)
class Flags:
    """Simulate the arm and host the bus."""

    common: Common = field(default_factory=Options)
    own: Annotated[SimFlags, tyro.conf.arg(name="")] = field(default_factory=SimFlags)


def main() -> None:
    """Run until SIGTERM or Ctrl-C."""
    flags = tyro.cli(Flags)
    log = start_logging("sim", flags.common.log)
    stopping = realtime.stop_on_signals()
    config = load_robot(flags.common.robot_config)
    loops, others = realtime.split_cores(flags.common.loop_core)
    missing = realtime.keep_to(loops)
    if flags.own.clock != "stepped":
        missing += realtime.become_real_time(priority=40)
    for sentence in missing:
        if flags.own.clock == "realtime":
            log.warning("without %s: ticks may come late", sentence)
        else:
            log.info("without %s: robot time may run slower than the wall clock", sentence)
    with service_bus("sim", flags.common, config.name, stopping, log, hosts=True) as bus:
        loop = SimLoop(bus, config, flags.own.clock, flags.own.seed, log)
        realtime.keep_to(others)  # what `open` starts: threads that take requests
        loop.open()
        realtime.keep_to(loops)
        log.info("robot %s, %s clock", bus.robot, flags.own.clock)
        realtime.freeze_garbage()
        try:
            loop.run(stopping)
        except Diverged as diverged:
            log.error("%s", diverged)
            raise SystemExit(1) from None


if __name__ == "__main__":
    main()
