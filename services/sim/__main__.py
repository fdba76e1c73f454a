"""`python -m services.sim`: the simulated arm, which hosts the bus unless told otherwise."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from services import runtime
from services.flags import SimFlags
from services.logs import start_logging
from services.options import Common, Options
from services.place import service_bus
from services.robot import load_robot
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
    stopping = runtime.stop_on_signals()
    config = load_robot(flags.common.robot_config)
    loops, others = runtime.split_cores(flags.common.loop_core)
    missing = runtime.keep_to(loops)
    if flags.own.clock == "realtime":
        missing += runtime.become_real_time(priority=40)
    for sentence in missing:
        log.warning("without %s: ticks may come late", sentence)
    with service_bus("sim", flags.common, config.name, stopping, log, hosts=True) as bus:
        loop = SimLoop(bus, config, flags.own.clock, flags.own.seed, log)
        runtime.keep_to(others)  # what `open` starts: threads that take requests
        loop.open()
        runtime.keep_to(loops)
        log.info("robot %s, %s clock", bus.robot, flags.own.clock)
        runtime.freeze_garbage()
        try:
            loop.run(stopping)
        except Diverged as diverged:
            log.error("%s", diverged)
            raise SystemExit(1) from None


if __name__ == "__main__":
    main()
