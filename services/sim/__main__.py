"""`python -m services.sim`: the simulated arm, which hosts the bus unless --connect is given."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from services.common.cli import Common, Options, SimFlags
from services.common.robot_side.clocks import keep_time
from services.common.robot_side.process import run_robot
from services.sim.loop import SimLoop
from services.sim.stepped import run_stepped


@dataclass(frozen=True, slots=True)
class Flags:
    """Simulate the arm and host the bus."""

    common: Common = field(default_factory=Options)
    own: Annotated[SimFlags, tyro.conf.arg(name="")] = field(default_factory=SimFlags)


def main() -> None:
    """Run until SIGTERM or Ctrl-C.

    Raises:
        SystemExit: with the `Outcome` of the instance.
    """
    flags = tyro.cli(Flags)
    clock, seed = flags.own.clock, flags.own.seed
    outcome = run_robot(
        "sim",
        flags.common,
        clock,
        lambda bus, config, log: SimLoop(bus, config, clock, seed, log),
        run_stepped if clock == "stepped" else keep_time,
    )
    raise SystemExit(outcome)


if __name__ == "__main__":
    main()
