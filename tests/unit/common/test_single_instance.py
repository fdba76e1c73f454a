"""How a service takes its place on the bus, and leaves it to another."""

import contextlib
import logging
import socket
import threading

import pytest

from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.topics import claim_key
from services.common.cli import Options, free_endpoint
from services.common.realtime import EXIT_TAKEN
from services.common.single_instance import service_bus
from tests.connections import connections, port_of
from tests.waiting import eventually

LOG = logging.getLogger("test")


@pytest.fixture
def hub() -> str:
    """An endpoint that nobody has taken yet."""
    return free_endpoint()


def test_waiting_for_a_hub_can_be_given_up(hub: str, caplog: pytest.LogCaptureFixture):
    """Without an error, as a signal would have it; meanwhile the log says what is waited for."""
    caplog.set_level(logging.INFO)
    stopping = threading.Event()
    stopping.set()
    with pytest.raises(SystemExit) as caught, service_bus("planner", Options(connect=(hub,)), "arm", stopping, LOG):
        pass
    assert caught.value.code == 0
    assert f"nobody hosts the bus at {hub} yet" in caplog.text


def test_a_service_that_would_let_anybody_in_logs_why_not(caplog: pytest.LogCaptureFixture):
    """And ends with status 1."""
    options = Options(listen=("tcp/0.0.0.0:0",))
    with pytest.raises(SystemExit) as caught, service_bus("sim", options, "arm", threading.Event(), LOG, hosts=True):
        pass
    assert caught.value.code == 1
    assert "will not listen on tcp/0.0.0.0:0" in caplog.text


def test_a_place_that_is_taken_is_left_alone(hub: str, caplog: pytest.LogCaptureFixture):
    """Status 3 and a sentence, both for who joins the bus and for who would host it; others find room."""
    with Bus(open_session(listen=[hub])) as first:
        first.announce("sim")
        for options, hosts in ((Options(connect=(hub,)), False), (Options(listen=(hub,)), True)):
            caplog.clear()
            with pytest.raises(SystemExit) as caught, service_bus("sim", options, "arm", threading.Event(), LOG, hosts):
                pass
            assert caught.value.code == EXIT_TAKEN
            assert "another sim serves robot arm on this bus" in caplog.text
        with service_bus("planner", Options(connect=(hub,)), "arm", threading.Event(), LOG) as bus:
            assert bus.robot == "arm"
        with service_bus("sim", Options("left", connect=(hub,)), "arm", threading.Event(), LOG) as bus:
            assert bus.robot == "left"


def test_a_bus_that_cannot_be_hosted_is_status_1(hub: str, caplog: pytest.LogCaptureFixture):
    """The port is taken, but by nobody who is the sim."""
    with (
        Bus(open_session(listen=[hub])),
        pytest.raises(SystemExit) as caught,
        service_bus("sim", Options(listen=(hub,)), "arm", threading.Event(), LOG, hosts=True),
    ):
        pass
    assert caught.value.code == 1
    assert "cannot open the bus" in caplog.text


@pytest.mark.parametrize("rival", [True, False])
def test_who_comes_back_and_finds_another_in_his_place_ends(hub: str, rival: bool, caplog: pytest.LogCaptureFixture):
    """As after 20 s of SIGSTOP in which another was started: two who command one arm would both be heard."""
    stopping, statuses = threading.Event(), []

    def serve() -> None:
        try:
            with service_bus("controller", Options(connect=(hub,)), "arm", stopping, LOG) as bus:
                bus.announce("controller")
                stopping.wait()
        except SystemExit as end:
            statuses.append(end.code)

    service = threading.Thread(target=serve)
    with Bus(open_session(listen=[hub])) as host:
        service.start()
        assert eventually(lambda: host.is_alive("controller"), 10.0)
        place = claim_key("controller" if rival else "planner", "rival")
        token = host.session.liveliness().declare_token(host.key(place))
        try:
            for connection in connections(port_of(hub)):
                with contextlib.suppress(OSError):  # the other end was first
                    connection.shutdown(socket.SHUT_RDWR)
            assert stopping.wait(10.0 if rival else 2.0) is rival
            assert eventually(lambda: host.is_alive("controller") is not rival, 10.0)
        finally:
            stopping.set()
            service.join()
            token.undeclare()
    assert statuses == ([EXIT_TAKEN] if rival else [])
    assert ("another controller serves robot arm" in caplog.text) is rival
