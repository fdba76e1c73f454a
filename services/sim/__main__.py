"""`python -m services.sim`: the simulated arm, which hosts the router unless --connect is given."""

import logging
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated

import tyro

from protocol.bus.bus import Bus
from robot.description import RobotConfig, load_robot
from robot.schema import RobotError
from services.common.cli import MISUSED, Common, Options, SimFlags
from services.common.robot_side.clocks import keep_time
from services.common.robot_side.process import run_robot
from services.sim.loop import SimLoop, run_stepped
from services.sim.world import World


@dataclass(frozen=True, slots=True)
class Flags:
    """Simulate the arm, or several arms of one model, and host the router."""

    common: Common = field(default_factory=Options)
    own: Annotated[SimFlags, tyro.conf.arg(name="")] = field(default_factory=SimFlags)


def main() -> None:
    """Run until SIGTERM or Ctrl-C.

    Raises:
        SystemExit: with the `Outcome` of the instance.
    """
    flags = tyro.cli(Flags)
    clock, seed = flags.own.clock, flags.own.seed
    others = load_others(flags.own.also)
    if not 0 < flags.own.pace <= 1:
        print(f"sim: --pace is {flags.own.pace:g}; it must be more than 0 and at most 1", file=sys.stderr)
        raise SystemExit(MISUSED)

    def build(bus: Bus, config: RobotConfig, log: logging.Logger) -> list[SimLoop]:
        configs = [config, *others]
        buses = [bus, *(Bus(bus.session, other.name) for other in others)]
        try:
            world = World(configs)
        except RobotError as error:
            log.error("%s", error)
            raise SystemExit(MISUSED) from None
        return [SimLoop(own, arm, clock, seed, log, world) for own, arm in zip(buses, configs, strict=True)]

    keep = run_stepped if clock == "stepped" else partial(keep_time, pace=flags.own.pace)
    names = [config.name for config in others]
    raise SystemExit(run_robot("sim", flags.common, clock, build, keep, names))


def load_others(paths: Sequence[Path]) -> list[RobotConfig]:
    """Return the other robots of a simulation.

    Raises:
        SystemExit: a file cannot be read.
    """
    try:
        return [load_robot(path) for path in paths]
    except RobotError as error:
        print(f"sim: --also: {error}", file=sys.stderr)
        raise SystemExit(MISUSED) from None


if __name__ == "__main__":
    main()
