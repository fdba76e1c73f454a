"""The shared flags, and how a service takes its place on the bus."""

import logging
import threading
from pathlib import Path

import pytest
import tyro
import zenoh

from protocol.bus import Bus
from protocol.sessions import open_session
from services.options import Options, free_endpoint, open_bus, service_bus
from services.runtime import EXIT_TAKEN

LOG = logging.getLogger("test")


@pytest.fixture
def hub() -> str:
    """An endpoint that nobody has taken yet."""
    return free_endpoint()


def test_flags_without_a_prefix():
    """As every service and `python -m services` take them."""
    line = "--robot left --robot-config a.toml --connect tcp/h:1 tcp/h:2 --zenoh-config z.json5 --log json"
    options = tyro.cli(Options, args=line.split())
    assert options == Options("left", Path("a.toml"), ("tcp/h:1", "tcp/h:2"), (), Path("z.json5"), log="json")


def test_the_shipped_robot_is_the_default():
    """Wherever the process was started."""
    assert Options().robot_config.is_absolute()
    assert Options().robot_config.exists()


def test_endpoints_are_free():
    """On loopback, one after the other."""
    endpoints = {free_endpoint() for _ in range(5)}
    for endpoint in endpoints:
        assert endpoint.startswith("tcp/127.0.0.1:")
        open_session(listen=[endpoint]).close()


def test_the_robot_config_names_the_robot_unless_a_flag_does(hub: str):
    """The second part of every key."""
    for flag, name in ((None, "arm"), ("left", "left")):
        with open_bus(Options(robot=flag, listen=(hub,)), "arm") as bus:
            assert bus.key("goal") == f"volley/{name}/goal"


def test_waiting_for_a_hub_can_be_given_up(hub: str, caplog: pytest.LogCaptureFixture):
    """Without an error, as a signal would have it; meanwhile the log says what is waited for."""
    caplog.set_level(logging.INFO)
    stopping = threading.Event()
    stopping.set()
    with pytest.raises(SystemExit) as caught, service_bus("planner", Options(connect=(hub,)), "arm", stopping, LOG):
        pass
    assert caught.value.code == 0
    assert f"nobody hosts the bus at {hub} yet" in caplog.text


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


def test_a_service_that_would_let_anybody_in_logs_why_not(caplog: pytest.LogCaptureFixture):
    """And ends with status 1."""
    options = Options(listen=("tcp/0.0.0.0:0",))
    with pytest.raises(SystemExit) as caught, service_bus("sim", options, "arm", threading.Event(), LOG, hosts=True):
        pass
    assert caught.value.code == 1
    assert "will not listen on tcp/0.0.0.0:0" in caplog.text


def test_a_bad_zenoh_config_is_told(tmp_path: Path, hub: str):
    """By Zenoh's own error, without waiting for a hub."""
    path = tmp_path / "bad.json5"
    path.write_text('{ "mode": "captain" }')
    with pytest.raises(zenoh.ZError):
        open_bus(Options(connect=(hub,), zenoh_config=path), "arm")
