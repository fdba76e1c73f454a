"""A service claims its place on the bus, serves, and yields to another instance."""

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
from tools.drill.harness.waiting import PATIENCE_S, eventually

LOG = logging.getLogger("test")


class Service:
    """An instance in a thread that announces itself and serves until it is stopped."""

    def __init__(self, name: str, options: Options, hosts: bool = False, other_robots: Sequence[str] = ()) -> None:
        self.stopping = threading.Event()
        self.outcome: Outcome | None = None
        self.robot = ""
        self._name = name
        self._instance = SingleInstance(name, options, "arm", LOG, hosts=hosts, other_robots=other_robots)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        self.outcome = self._instance.run(self._serve, self.stopping)

    def _serve(self, bus: Bus) -> None:
        bus.announce(self._name)
        self.robot = bus.robot
        self.stopping.wait()

    def __enter__(self) -> "Service":
        """Wait until the instance serves."""
        assert eventually(lambda: self.robot)
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> Outcome | None:
        """Stop the instance and return how it ended."""
        self.stopping.set()
        self._thread.join()
        return self.outcome


def outcome_of(name: str, options: Options, hosts: bool = False) -> Outcome:
    """Run an instance that must not start to serve, and return how it ended."""
    return SingleInstance(name, options, "arm", LOG, hosts=hosts).run(lambda _: pytest.fail(), threading.Event())


@pytest.fixture
def router() -> str:
    """Return an endpoint on which nobody listens yet."""
    return free_endpoint()


def test_an_instance_that_is_stopped_has_served(router: str):
    """The status is 0; the bus is closed, and the place is free."""
    for _ in range(2):
        with Service("sim", Options(listen=(router,)), hosts=True) as service:
            assert service.end() is Outcome.ENDED


def test_waiting_for_a_router_can_be_given_up(router: str, caplog: pytest.LogCaptureFixture):
    """A signal ends the wait without an error; the log says what is waited for."""
    caplog.set_level(logging.INFO)
    service = Service("planner", Options(connect=(router,)))
    assert eventually(lambda: f"nobody hosts the bus at {router} yet" in caplog.text)
    assert service.end() is Outcome.ENDED
    assert not service.robot


def test_an_exposed_service_logs_why_it_does_not_start(caplog: pytest.LogCaptureFixture):
    """The service fails instead of listening without certificates."""
    assert outcome_of("sim", Options(listen=("tcp/0.0.0.0:0",)), hosts=True) is Outcome.FAILED
    assert "will not listen on tcp/0.0.0.0:0" in caplog.text


@pytest.mark.parametrize("hosts", [False, True])
def test_a_second_instance_does_not_start(router: str, hosts: bool, caplog: pytest.LogCaptureFixture):
    """A second instance ends with a sentence, whether it connects or hosts; other services are free to start."""
    joining = Options(connect=(router,))
    with Service("sim", Options(listen=(router,)), hosts=True):
        assert outcome_of("sim", Options(listen=(router,)) if hosts else joining, hosts) is Outcome.TAKEN
        assert "another sim serves robot arm on this bus" in caplog.text
        with Service("planner", joining) as planner, Service("sim", Options("left", connect=(router,))) as left:
            assert (planner.robot, left.robot) == ("arm", "left")


def test_one_instance_takes_the_places_of_several_robots(router: str, caplog: pytest.LogCaptureFixture):
    """It ends if one of the places is taken."""
    left = Options("left", connect=(router,))
    with Service("sim", Options(listen=(router,)), hosts=True, other_robots=("left",)) as both:
        assert outcome_of("sim", left) is Outcome.TAKEN
        assert "another sim serves robot left on this bus" in caplog.text
        caplog.clear()
        right = SingleInstance("sim", Options("right", connect=(router,)), "arm", LOG, other_robots=("left",))
        assert right.run(lambda _: pytest.fail(), both.stopping) is Outcome.TAKEN
        assert "another sim serves robot left on this bus" in caplog.text


def test_arms_of_one_machine_are_hosted_side_by_side(router: str):
    """Each has its own bus, even if the names are the same."""
    with (
        Service("sim", Options(listen=(router,)), hosts=True),
        Service("sim", Options(listen=(free_endpoint(),)), hosts=True) as second,
        Service("sim", Options("left", listen=(free_endpoint(),)), hosts=True) as third,
    ):
        assert (second.robot, third.robot) == ("arm", "left")


def test_a_bus_that_cannot_be_hosted_is_a_failure(router: str, caplog: pytest.LogCaptureFixture):
    """The port is in use, but not by a sim."""
    with Bus(open_session(listen=[router])):
        assert outcome_of("sim", Options(listen=(router,)), hosts=True) is Outcome.FAILED
    assert "cannot open the bus" in caplog.text


@pytest.mark.parametrize("rival", [True, False])
def test_an_instance_that_was_replaced_ends(router: str, rival: bool, caplog: pytest.LogCaptureFixture):
    """An instance that was suspended for 20 s and replaced must end, because two controllers would both be obeyed."""
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
