"""`python -m services.planner`: learn primitives and plan goals."""

import gc
import logging
import threading
import time
import uuid
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from motion.errors import InvalidMotion
from protocol import messages as m
from protocol import topics
from protocol.bus import Asking, Bus
from protocol.errors import NoAnswer, Refusal
from protocol.queues import Inbox
from services import runtime
from services.flags import PlannerFlags
from services.logs import start_logging
from services.options import Common, Options
from services.place import service_bus
from services.planner.core import Lead, Planner
from services.planner.learning import learn_from_csv, prepare_to_learn
from services.planner.library import Library
from services.planner.watch import ControllerWatch
from services.puts import PutWatch
from services.robot import RobotConfig, load_robot

SHIPPED = Path(__file__).resolve().parents[2] / "deploy" / "demonstrations"


@dataclass(frozen=True, slots=True)
class Flags:
    """Learn primitives and plan goals."""

    common: Common = field(default_factory=Options)
    own: Annotated[PlannerFlags, tyro.conf.arg(name="")] = field(default_factory=PlannerFlags)


def main() -> None:
    """Run until SIGTERM or Ctrl-C."""
    flags = tyro.cli(Flags)
    log = start_logging("planner", flags.common.log)
    stopping = runtime.stop_on_signals()
    _, others = runtime.split_cores(flags.common.loop_core)
    runtime.keep_to(others)
    config = load_robot(flags.common.robot_config)
    library = Library(flags.own.library, log)
    if library.is_new:
        learn_shipped(library, config, log)
    lead = Lead(config.tick, flags.own.lead)
    with service_bus("planner", flags.common, config.name, stopping, log) as bus:
        runtime.become_polite()
        planner = Planner(bus, config, library, lead, log)
        planner.warm_up()
        runtime.freeze_garbage()
        serve(bus, planner, lead, log, stopping)


def learn_shipped(library: Library, config: RobotConfig, log: logging.Logger) -> None:
    """Learn every shipped demonstration of this arm."""
    for path in sorted(SHIPPED.glob("*.csv")):
        try:
            primitive = learn_from_csv(path, config.joint_names)
        except InvalidMotion as error:
            log.warning("%s: %s", path.name, error)
            continue
        if primitive is not None:
            library.put(path.stem, primitive)
            log.info("learned %s from the demonstration that ships with Volley", path.stem)


def serve(bus: Bus, planner: Planner, lead: Lead, log: logging.Logger, stopping: threading.Event) -> None:
    """Answer requests one at a time until `stopping` is set."""
    inbox: Inbox[Asking] = Inbox()
    arm_appeared = threading.Event()
    watch, puts = ControllerWatch(bus, log), PutWatch(bus, log)
    prepared = False
    for query in topics.QUERIES:
        if query.owner == "planner":
            bus.serve(query, inbox)
    bus.announce("planner")
    bus.watch_alive(topics.alive_key("sim"), lambda _, alive: arm_appeared.set() if alive else None)
    while not stopping.is_set():
        asking = inbox.take(0.1)
        watch.look(time.monotonic())
        puts.look()
        if arm_appeared.is_set():
            arm_appeared.clear()
            lead.stepped = is_stepped(bus)
        if asking is not None:
            answer(asking, planner, log)
        elif not prepared:
            prepare_to_learn()
            runtime.freeze_garbage()
            prepared = True
        # Never while one plans: after each what is new, when there is time everything.
        gc.collect(1 if asking is not None else 2)


def answer(asking: Asking, planner: Planner, log: logging.Logger) -> None:
    """Reply to a request, or refuse it and say why in the log, and of a goal on the bus, under the goal's id.

    An error that nobody foresaw is refused as well: it is one request's, and the planner goes on for the others.
    """
    goal, goal_id = None, None
    try:
        match request := asking.decode():
            case m.Goal() as goal:
                # Cut, for an id may be refused for its length.
                goal_id = (goal.goal_id or uuid.uuid4().hex)[: topics.MAX_ID]
                planner.goal(goal, goal_id, asking.arrival_ns, asking.reply)
            case m.Learn():
                asking.reply(planner.learn(request))
            case m.Forget():
                asking.reply(planner.forget(request))
            case _:
                asking.reply(planner.primitives(request))
        return
    except Refusal as reason:
        refusal = reason
    except Exception:
        log.exception("%s met an error of the planner", asking.topic.key, extra={"goal_id": goal_id})
        detail = {"service": "planner"} | ({"goal_id": goal_id} if goal_id else {})
        sentence = "the planner met an error of its own; please report what its log says"
        refusal = Refusal("unavailable", sentence, **detail)
    asking.refuse(refusal)
    fields = {"goal_id": goal_id, "code": refusal.code}
    log.info("%s refused as %s: %s", asking.topic.key, refusal.code, refusal, extra=fields)
    if asking.topic is topics.GOAL:
        planner.tell_refused(goal, goal_id, refusal, asking.arrival_ns)


def is_stepped(bus: Bus) -> bool:
    """Return whether the arm's clock advances on request only."""
    try:
        return bus.ask(topics.DESCRIPTION, m.Empty(), timeout=1.0).clock == "stepped"
    except (NoAnswer, Refusal):
        return False


if __name__ == "__main__":
    main()
