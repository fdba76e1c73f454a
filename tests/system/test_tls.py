"""Who may connect over TLS, and a motion and a second router over it."""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import zenoh
from cell import SecureCell
from harness import ROBOT, SERVICES, Stack, wait_for_controller

from deploy.zenoh.configure import client_config
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.errors import NoAnswer
from services.common.cli import Options
from services.common.single_instance import Outcome, SingleInstance
from services.common.supervisor import Supervisor, command_lines
from tests.cores import LOOP_CORE

LOG = logging.getLogger("test")


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> SecureCell:
    """Write a cell with its own certificate authority."""
    return SecureCell(tmp_path_factory.mktemp("other"))


def let_in(config_file: Path | None, connect: tuple[str, ...] = (), tries: int = 2) -> bool:
    """Return whether the router accepts a session; the first of several tries may fail on a busy machine."""
    left = iter(range(tries - 1, -1, -1))
    try:
        open_session(connect, config_file=config_file, give_up=lambda: next(left) == 0).close()
    except zenoh.ZError as error:
        assert "Unable to connect" in str(error)
        return False
    return True


def test_who_is_not_let_in(cell: SecureCell, other: SecureCell):
    """Refuse plain TCP, no certificate, a certificate of another authority; refuse a router of another authority."""
    config = client_config(cell.cell, "operator")
    tls = config["transport"]["link"]["tls"]
    theirs = {
        "connect_certificate": str(other.tls / "operator.pem"),
        "connect_private_key": str(other.tls / "operator.key"),
    }
    refused = {
        "without": tls | {"enable_mtls": False},
        "theirs": tls | theirs,
        "distrusting": tls | {"root_ca_certificate": str(other.tls / "ca.pem")},
    }
    with cell.host():
        assert let_in(cell.write("good", config), tries=40)
        assert not let_in(None, (cell.endpoint.replace("tls/", "tcp/"),))
        for name, changed in refused.items():
            config["transport"]["link"]["tls"] = changed
            assert not let_in(cell.write(name, config)), name


def test_a_host_by_another_name_is_not_joined(tmp_path: Path):
    """A client refuses a router whose certificate does not have the name in its endpoint."""
    elsewhere = SecureCell(tmp_path, certified="robot.local")
    with elsewhere.host():
        assert not let_in(elsewhere.file("operator"))
        config = client_config(elsewhere.cell, "operator")
        config["transport"]["link"]["tls"]["verify_name_on_connect"] = False
        assert let_in(elsewhere.write("careless", config), tries=40)


@contextmanager
def secure_services(cell: SecureCell, library: Path) -> Iterator[Stack]:
    """Start sim, planner and controller on the stepped clock, each with its certificate; yield a tester's stack."""
    flags = {"clock": "stepped", "library": library}
    lines = {}
    for name in SERVICES:
        hosting = name == "sim"
        options = Options(
            listen=(cell.endpoint,) if hosting else (),
            connect=() if hosting else (cell.endpoint,),
            zenoh_config=cell.file("router" if hosting else name),
            loop_core=LOOP_CORE,
        )
        lines[name] = command_lines(options, flags)[name]
    with Supervisor(lines) as supervisor, cell.join("tester") as bus:
        supervisor.wait_ready(bus)
        stack = Stack(supervisor, bus, cell.endpoint, library.parent, ROBOT, True)
        wait_for_controller(stack)
        yield stack


def test_a_motion_over_tls(other: SecureCell, tmp_path: Path):
    """An operator's goal is played to its end; a viewer can read the status, but neither start nor stop a motion."""
    with (
        secure_services(other, tmp_path / "library") as stack,
        other.join("operator") as operator,
        other.join("viewer") as viewer,
    ):
        stack.reset()
        goal = m.Goal(primitive="forehand", positions=stack.home, duration=0.3)
        with pytest.raises(NoAnswer):
            viewer.ask(topics.GOAL, goal)
        with pytest.raises(NoAnswer):
            operator.ask(topics.SIM_STEP, m.Step(ticks=1))
        reply = operator.ask(topics.GOAL, goal)
        stack.step(100)
        with pytest.raises(NoAnswer):
            viewer.ask(topics.CANCEL, m.Cancel())
        assert viewer.ask(topics.STATUS_QUERY, m.Empty()).goal_id == reply.goal_id
        result = stack.finish(reply)
        assert result.outcome == "succeeded"
        assert stack.status().cycle.refused == 0


def test_a_second_router_ends_as_taken(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    """A second sim with the configuration of the first ends as taken, over TLS too. The file's port is the bus's."""
    cell = SecureCell(tmp_path)
    options = Options(zenoh_config=cell.file("router"))
    stopping = threading.Event()

    def look_from_outside(bus: Bus) -> None:
        bus.announce("sim")
        with cell.join("viewer") as viewer:
            assert viewer.is_alive("sim")
        second = SingleInstance("sim", options, "arm", LOG, hosts=True)
        assert second.run(lambda _: pytest.fail(), stopping) is Outcome.TAKEN

    assert SingleInstance("sim", options, "arm", LOG, hosts=True).run(look_from_outside, stopping) is Outcome.ENDED
    assert "another sim serves robot arm on this bus" in caplog.text
