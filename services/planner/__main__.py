"""`python -m services.planner`: learn primitives and plan goals."""

import logging
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from motion.errors import InvalidMotion
from protocol.bus.bus import Bus
from robot.description import RobotConfig
from robot.shipped import DEMONSTRATIONS
from services.common import realtime
from services.common.cli import LIBRARIES, MISUSED, Common, Options, PlannerFlags
from services.common.single_instance import SingleInstance
from services.common.startup import start_beside_loops
from services.planner.core import Planner
from services.planner.lead_time import LeadTime
from services.planner.learning import learn_from_csv
from services.planner.library import Arm, Library
from services.planner.loop import Loop


@dataclass(frozen=True, slots=True)
class Flags:
    """Learn primitives and plan goals."""

    common: Common = field(default_factory=Options)
    own: Annotated[PlannerFlags, tyro.conf.arg(name="")] = field(default_factory=PlannerFlags)


def main() -> None:
    """Run until SIGTERM or Ctrl-C, and exit with the `Outcome` of the instance."""
    flags = tyro.cli(Flags)
    log, stopping, config = start_beside_loops("planner", flags.common)
    robot = flags.common.robot or config.name
    directory = flags.own.library or LIBRARIES / robot
    try:
        library = Library(directory, Arm(robot, config.joint_names), log)
        if library.is_new:
            learn_shipped(library, config, log)
            if flags.own.library is None:
                take_over(library, LIBRARIES, robot, log)
            library.begin()
    except OSError as error:
        log.error("the library %s cannot be used: %s; name another directory with --library", directory, error.strerror)
        raise SystemExit(MISUSED) from None
    lead = LeadTime(config.tick, flags.own.lead)

    def serve(bus: Bus) -> None:
        planner = Planner(bus, config, library, lead, log)
        planner.warm_up()
        realtime.freeze_garbage()
        realtime.prioritise_existing_threads()
        Loop(bus, planner, library, config, lead, log).serve(stopping)

    realtime.become_prompt()
    raise SystemExit(SingleInstance("planner", flags.common, config.name, log).run(serve, stopping))


def learn_shipped(library: Library, config: RobotConfig, log: logging.Logger) -> None:
    """Learn every shipped demonstration of this arm."""
    for path in sorted(DEMONSTRATIONS.glob("*.csv")):
        try:
            primitive = learn_from_csv(path, config.joint_names)
        except InvalidMotion as error:
            log.warning("%s: %s", path.name, error)
            continue
        if primitive is not None:
            library.put(path.stem, primitive)
            log.info("learned %s from the demonstration that ships with Volley", path.stem)


def take_over(library: Library, old: Path, robot: str, log: logging.Logger) -> None:
    """Copy the library `old` of an earlier version, which all robots shared, to the shipped arm's library.

    Its files do not name their arm, so for other arms this only logs that it exists.
    """
    files = sorted(old.glob("*.npz"))
    if not files:
        return
    if not list(library):  # no shipped demonstration is for this arm
        sentence = "%s has primitives of an earlier version, which do not name their arm; move this robot's into %s"
        log.warning(sentence, old, old / robot)
        return
    taken = 0
    for path in files:
        try:
            library.take_over(path)
            taken += 1
        except Exception as error:
            log.warning("%s is not a primitive and is left alone: %s", path, error)
    log.info("%d primitives of an earlier version were taken over from %s", taken, old)


if __name__ == "__main__":
    main()
