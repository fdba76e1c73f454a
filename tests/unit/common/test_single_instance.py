"""How a service takes its place on the bus, and leaves it to another."""

import contextlib
import logging
import socket
import threading
from collections.abc import Sequence

import pytest

from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from protocol.topics import claim_key
from services.common.cli import Options, free_endpoint
from services.common.single_instance import Outcome, SingleInstance
from tests.connections import connections, port_of
from tests.waiting import PATIENCE_S, eventually

LOG = logging.getLogger("test")


class Service:
    """An instance at work in a thread, which announces itself and serves until it is stopped."""

    def __init__(self, name: str, options: Options, hosts: bool = False, beside: Sequence[str] = ()) -> None:
        self.stopping = threading.Event()
        self.outcome: Outcome | None = None
        self.robot = ""
        self._name = name
        self._instance = SingleInstance(name, options, "arm", LOG, hosts=hosts, beside=beside)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        self.outcome = self._instance.run(self._serve, self.stopping)

    def _serve(self, bus: Bus) -> None:
        bus.announce(self._name)
        self.robot = bus.robot
        self.stopping.wait()

    def __enter__(self) -> "Service":
        """Wait until it serves."""
        assert eventually(lambda: self.robot)
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> Outcome | None:
        """Stop it and return how it ended."""
        self.stopping.set()
        self._thread.join()
        return self.outcome


def outcome_of(name: str, options: Options, hosts: bool = False) -> Outcome:
    """Run an instance that must not come to serve."""
    return SingleInstance(name, options, "arm", LOG, hosts=hosts).run(lambda _: pytest.fail(), threading.Event())


@pytest.fixture
def router() -> str:
    """An endpoint that nobody has taken yet."""
    return free_endpoint()


def test_an_instance_that_is_stopped_has_served(router: str):
    """Status 0; the bus is closed, and the place free for the next."""
    for _ in range(2):
        with Service("sim", Options(listen=(router,)), hosts=True) as service:
            assert service.end() is Outcome.ENDED


def test_waiting_for_a_router_can_be_given_up(router: str, caplog: pytest.LogCaptureFixture):
    """Without an error, as a signal would have it; meanwhile the log says what is waited for."""
    caplog.set_level(logging.INFO)
    service = Service("planner", Options(connect=(router,)))
    assert eventually(lambda: f"nobody hosts the bus at {router} yet" in caplog.text)
    assert service.end() is Outcome.ENDED
    assert not service.robot


def test_a_service_that_would_let_anybody_in_logs_why_not(caplog: pytest.LogCaptureFixture):
    """And has failed."""
    assert outcome_of("sim", Options(listen=("tcp/0.0.0.0:0",)), hosts=True) is Outcome.FAILED
    assert "will not listen on tcp/0.0.0.0:0" in caplog.text


@pytest.mark.parametrize("hosts", [False, True])
def test_a_place_that_is_taken_is_left_alone(router: str, hosts: bool, caplog: pytest.LogCaptureFixture):
    """With a sentence, both for who joins the bus and for who would host it; others find room."""
    joining = Options(connect=(router,))
    with Service("sim", Options(listen=(router,)), hosts=True):
        assert outcome_of("sim", Options(listen=(router,)) if hosts else joining, hosts) is Outcome.TAKEN
        assert "another sim serves robot arm on this bus" in caplog.text
        with Service("planner", joining) as planner, Service("sim", Options("left", connect=(router,))) as left:
            assert (planner.robot, left.robot) == ("arm", "left")


def test_one_instance_takes_the_places_of_several_robots(router: str, caplog: pytest.LogCaptureFixture):
    """And ends where one of them is taken."""
    left = Options("left", connect=(router,))
    with Service("sim", Options(listen=(router,)), hosts=True, beside=("left",)) as both:
        assert outcome_of("sim", left) is Outcome.TAKEN
        assert "another sim serves robot left on this bus" in caplog.text
        caplog.clear()
        right = SingleInstance("sim", Options("right", connect=(router,)), "arm", LOG, beside=("left",))
        assert right.run(lambda _: pytest.fail(), both.stopping) is Outcome.TAKEN
        assert "another sim serves robot left on this bus" in caplog.text


def test_arms_of_one_machine_are_hosted_side_by_side(router: str):
    """On buses of their own, be their names the same or not."""
    with (
        Service("sim", Options(listen=(router,)), hosts=True),
        Service("sim", Options(listen=(free_endpoint(),)), hosts=True) as second,
        Service("sim", Options("left", listen=(free_endpoint(),)), hosts=True) as third,
    ):
        assert (second.robot, third.robot) == ("arm", "left")


def test_a_bus_that_cannot_be_hosted_is_a_failure(router: str, caplog: pytest.LogCaptureFixture):
    """The port is taken, but not by the sim."""
    with Bus(open_session(listen=[router])):
        assert outcome_of("sim", Options(listen=(router,)), hosts=True) is Outcome.FAILED
    assert "cannot open the bus" in caplog.text


@pytest.mark.parametrize("rival", [True, False])
def test_an_instance_that_was_replaced_ends(router: str, rival: bool, caplog: pytest.LogCaptureFixture):
    """As after 20 s of SIGSTOP in which another was started: two that command one arm would both be obeyed."""
    with Bus(open_session(listen=[router])) as host, Service("controller", Options(connect=(router,))) as service:
        assert eventually(lambda: host.is_alive("controller"))
        place = claim_key("controller" if rival else "planner", "rival")
        token = host.session.liveliness().declare_token(host.key(place))
        for connection in connections(port_of(router)):
            with contextlib.suppress(OSError):  # the other end was first
                connection.shutdown(socket.SHUT_RDWR)
        assert service.stopping.wait(PATIENCE_S if rival else 2.0) is rival
        assert eventually(lambda: host.is_alive("controller") is not rival)
        assert service.end() is (Outcome.TAKEN if rival else Outcome.ENDED)
        token.undeclare()
    assert ("another controller serves robot arm" in caplog.text) is rival
