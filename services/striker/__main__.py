"""`python -m services.striker`: return balls to a target."""

import logging
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.queues import Inbox
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig
from services.common import realtime
from services.common.cli import MISUSED, Common, Options, StrikerFlags
from services.common.single_instance import SingleInstance
from services.common.startup import start_beside_loops
from services.striker.bus_link import BusLink
from services.striker.core import Striker
from services.striker.hit_planner import CannotStrike, HitPlanner
from services.striker.loop import LENGTH, Loop
from services.striker.quintic import QuinticLink

LEARNED = Path.home() / ".local" / "share" / "volley" / "striker"


@dataclass(frozen=True, slots=True)
class Flags:
    """Return balls to a target."""

    common: Common = field(default_factory=Options)
    own: Annotated[StrikerFlags, tyro.conf.arg(name="")] = field(default_factory=StrikerFlags)


def main() -> None:
    """Run until SIGTERM or Ctrl-C.

    Raises:
        SystemExit: with the `Outcome` of the instance.
    """
    flags = tyro.cli(Flags)
    log, stopping, config = start_beside_loops("striker", flags.common)
    hit_planner = prepare(flags, config, log)

    def serve(bus: Bus) -> None:
        inbox: Inbox[Any] = Inbox(LENGTH)
        library = ask_library(bus, config, stopping)
        quintic = flags.own.method == "quintic"
        link = QuinticLink(bus, inbox, config) if quintic else BusLink(bus, inbox)
        striker = Striker(config, hit_planner, link, library, log, "dmp" if flags.own.method == "dmp" else "qp")
        realtime.freeze_garbage()
        realtime.prioritise_existing_threads()
        Loop(bus, inbox, striker, log).serve(stopping)

    realtime.become_prompt()
    raise SystemExit(SingleInstance("striker", flags.common, config.name, log).run(serve, stopping))


def prepare(flags: Flags, config: RobotConfig, log: logging.Logger) -> HitPlanner:
    """Build the striker's mathematics for this robot.

    Raises:
        SystemExit: the description, or the file of the learned law, cannot be used; the log says why.
    """
    learned = flags.own.learned or LEARNED / f"{(flags.common.robot or config.name).replace('/', '-')}.json"
    learned.parent.mkdir(parents=True, exist_ok=True)
    try:
        return HitPlanner(config, learned, log)
    except CannotStrike as error:
        log.error("%s", error)
        raise SystemExit(MISUSED) from None


def ask_library(bus: Bus, config: RobotConfig, stopping: threading.Event) -> list[tuple[str, float]]:
    """Wait for the planner; return name and duration (s) of this arm's primitives. Empty if stopped before."""
    while not stopping.wait(0.1):
        try:
            entries = bus.ask(topics.PRIMITIVES, m.Empty(), timeout=2.0).primitives
        except (NoAnswer, Refusal):
            continue
        names = list(config.joint_names)
        return [(entry.name, entry.duration) for entry in entries if entry.joint_names in ([], names)]
    return []


if __name__ == "__main__":
    main()
