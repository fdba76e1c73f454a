"""Starting a cell, waiting for it, and the errors that say why it did not start."""

import signal
import subprocess
import sys
import time

import pytest
import zenoh

from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.pending_query import PendingQuery
from protocol.bus.queues import Inbox
from protocol.bus.sessions import CLIENT, SERVICE, open_session
from services.common.cell import running_cell
from services.common.cli import Options, free_endpoint
from services.common.supervisor import NotReady
from tests.golden.values import STATUS
from tools.drill.harness.waiting import PATIENCE_S


def broken(program: str):
    """Return a wrap that starts `program` in place of every service."""
    return lambda _name, _line: [sys.executable, "-c", program]


def test_the_last_log_lines_of_a_dead_service_are_quoted():
    """The error quotes them although the log is not kept."""
    with (
        pytest.raises(NotReady, match="planner ended with status 1: out of oil"),
        running_cell(names=["planner"], quiet=True, wrap=broken("raise SystemExit('out of oil')")),
    ):
        pass


def test_the_error_of_an_occupied_place_has_a_remedy():
    with (
        pytest.raises(NotReady, match=r"sim ended with status 3: one of this robot runs already .* --listen"),
        running_cell(names=["sim"], quiet=True, wrap=broken("raise SystemExit(3)")),
    ):
        pass


def test_the_first_service_hosts_the_bus_if_the_sim_is_not_started():
    """If all services connect to an existing bus, none hosts it."""
    endpoint, hosting = free_endpoint(), []

    def note(_: str, line: list[str]) -> list[str]:
        hosting.append("--listen" in line)
        return [sys.executable, "-c", "raise SystemExit(1)"]

    for options in (Options(listen=(endpoint,)), Options(connect=(endpoint,))):
        with pytest.raises(NotReady), running_cell(options, names=["planner", "controller"], quiet=True, wrap=note):
            pass
    assert hosting == [True, False, False, False]


def test_giving_up_before_there_is_a_bus_is_an_error():
    """The error comes long before the timeout of the service, which here never hosts the bus."""
    sleeping = broken("import time; time.sleep(60)")
    with pytest.raises(zenoh.ZError), running_cell(names=["sim"], quiet=True, wrap=sleeping, give_up=lambda: True):
        pass


ASKING = """
import sys
from protocol import messages as m
from protocol import topics
from services.common.cell import running_cell
from services.common.cli import Options
waiting = lambda name, line: [sys.executable, "-c", "import threading; threading.Event().wait()"]
with running_cell(Options(connect=(sys.argv[1],)), names=["planner"], quiet=True, wrap=waiting) as cell:
    print(cell.bus.ask(topics.STATUS_QUERY, m.Empty(), timeout=60.0).mode)
"""


def test_a_stall_of_this_process_does_not_end_its_session():
    """The session has a service's timeouts; a client's session would expire earlier and lose the pending reply."""
    endpoint, inbox = free_endpoint(), Inbox[PendingQuery]()
    with Bus(open_session(listen=[endpoint], timeouts=SERVICE)) as bus:
        bus.serve(topics.STATUS_QUERY, inbox)
        bus.announce("planner")
        with subprocess.Popen([sys.executable, "-c", ASKING, endpoint], stdout=subprocess.PIPE, text=True) as asker:
            pending = inbox.take(PATIENCE_S)
            assert pending is not None
            asker.send_signal(signal.SIGSTOP)
            time.sleep(1.5 * CLIENT.lease_ms / 1000)
            asker.send_signal(signal.SIGCONT)
            pending.reply(STATUS)
            assert asker.communicate()[0] == "tracking\n"
