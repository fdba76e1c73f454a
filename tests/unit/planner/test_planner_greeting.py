"""The planner requests the description of an arm that appears, until it is answered."""

import logging
import threading
from pathlib import Path

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox
from protocol.bus.sessions import open_session
from robot.description import load_robot
from services.common.cli import free_endpoint
from services.planner.core import LeadTime, Planner
from services.planner.library import Arm, Library
from services.planner.loop import Loop
from tools.drill.harness.waiting import PATIENCE_S, eventually

LOG = logging.getLogger("planner")
ROBOT = load_robot()
ARM = Arm(ROBOT.name, ROBOT.joint_names)
LIMITS = m.RobotLimits(positions=[], velocities=[], accelerations=[], jerks=[], torques=[])
STEPPED = m.Description(joint_names=[], home=[], limits=LIMITS, rate_hz=1000.0, clock="stepped", run=1)


def test_a_request_for_the_description_that_is_not_answered_is_repeated(tmp_path: Path):
    """On a busy machine an answer can take longer than the planner's timeout."""
    endpoint, stopping, lead = free_endpoint(), threading.Event(), LeadTime(ROBOT.tick)
    with Bus(open_session(listen=[endpoint])) as arm, Bus(open_session([endpoint])) as bus:
        library = Library(tmp_path, ARM, LOG)
        loop = Loop(bus, Planner(bus, ROBOT, library, lead, LOG), library, ROBOT, lead, LOG)
        thread = threading.Thread(target=loop.serve, args=(stopping,))
        thread.start()
        try:
            greetings: Inbox[PendingQuery] = Inbox()
            arm.serve(topics.DESCRIPTION, greetings)
            arm.announce(topics.ROBOT_SIDE)
            assert greetings.take(PATIENCE_S) is not None, "the first, which is not answered"
            again = greetings.take(PATIENCE_S)
            assert again is not None
            again.reply(STEPPED)
            assert eventually(lambda: lead.stepped)
        finally:
            stopping.set()
            thread.join()
