"""The shared flags."""

import socket
from pathlib import Path

import pytest
import tyro
import zenoh

from protocol.bus.sessions import open_session
from robot.shipped import DEFAULT_ROBOT_CONFIG
from services.common.cli import Options, free_endpoint, free_port, is_taken, open_bus, robot_name


@pytest.fixture
def router() -> str:
    """An endpoint that nobody has taken yet."""
    return free_endpoint()


def test_flags_without_a_prefix():
    """As every service and `python -m services` take them."""
    line = "--robot left --robot-config a.toml --connect tcp/h:1 tcp/h:2 --zenoh-config z.json5 --loop-core 3"
    options = tyro.cli(Options, args=[*line.split(), "--log", "json"])
    places = Path("a.toml"), ("tcp/h:1", "tcp/h:2"), (), Path("z.json5")
    assert options == Options("left", *places, loop_core=3, log="json")


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


def test_a_port_that_is_taken_is_replaced():
    """By one that is free; one that is free is kept."""
    with socket.create_server(("127.0.0.1", free_port())) as other:
        taken = other.getsockname()[1]
        assert is_taken(f"tcp/127.0.0.1:{taken}")
        assert free_port(taken) != taken
    assert not is_taken(f"tcp/127.0.0.1:{taken}")
    assert free_port(taken) == taken


@pytest.mark.parametrize(
    "endpoint", ["unixsock-stream//tmp/volley", "tcp/no.such.host.invalid:7447", "tcp/192.0.2.1:7447"]
)
def test_what_cannot_be_known_is_not_called_taken(endpoint: str):
    """Zenoh says what is wrong with it."""
    assert not is_taken(endpoint)


def test_the_name_of_the_robot(tmp_path: Path):
    """The flag's, or that of the robot config, whose model is not read."""
    config = tmp_path / "leg.toml"
    with pytest.raises(ValueError, match=r"leg\.toml: cannot be read"):
        robot_name(Options(robot_config=config))
    toml = DEFAULT_ROBOT_CONFIG.read_text().replace('"arm"', '"leg"').replace('"arm.xml"', '"absent.xml"')
    config.write_text(toml)
    assert robot_name(Options(robot_config=config)) == "leg"
    assert robot_name(Options("left", robot_config=config)) == "left"
    with pytest.raises(ValueError, match=r"name: 'le\?t' cannot be a part of a key"):
        robot_name(Options("le?t", robot_config=config))


def test_the_robot_config_names_the_robot_unless_a_flag_does(router: str):
    """The second part of every key."""
    for flag, name in ((None, "arm"), ("left", "left")):
        with open_bus(Options(robot=flag, listen=(router,)), "arm") as bus:
            assert bus.key("goal") == f"volley/{name}/goal"


def test_a_bad_zenoh_config_is_an_error(tmp_path: Path, router: str):
    """By Zenoh's own error, without waiting for a router."""
    path = tmp_path / "bad.json5"
    path.write_text('{ "mode": "captain" }')
    with pytest.raises(zenoh.ZError):
        open_bus(Options(connect=(router,), zenoh_config=path), "arm")
