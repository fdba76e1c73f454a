"""The flags that all services share."""

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
    """Return an endpoint on which nobody listens yet."""
    return free_endpoint()


def test_flags_without_a_prefix():
    """Every service and `python -m services` accept the flags without a prefix."""
    line = "--robot left --robot-config a.toml --connect tcp/h:1 tcp/h:2 --zenoh-config z.json5 --loop-core 3"
    options = tyro.cli(Options, args=[*line.split(), "--log", "json"])
    places = Path("a.toml"), ("tcp/h:1", "tcp/h:2"), (), Path("z.json5")
    assert options == Options("left", *places, loop_core=3, log="json")


def test_the_shipped_robot_is_the_default():
    """The default does not depend on the working directory."""
    assert Options().robot_config.is_absolute()
    assert Options().robot_config.exists()


def test_endpoints_are_free():
    """Endpoints are on loopback and differ from each other."""
    endpoints = {free_endpoint() for _ in range(5)}
    for endpoint in endpoints:
        assert endpoint.startswith("tcp/127.0.0.1:")
        open_session(listen=[endpoint]).close()


def test_a_port_that_is_taken_is_replaced():
    """A port in use is replaced by a free one; a free one is kept."""
    with socket.create_server(("127.0.0.1", free_port())) as other:
        taken = other.getsockname()[1]
        assert is_taken(f"tcp/127.0.0.1:{taken}")
        assert free_port(taken) != taken
    assert not is_taken(f"tcp/127.0.0.1:{taken}")
    assert free_port(taken) == taken


@pytest.mark.parametrize(
    "endpoint", ["unixsock-stream//tmp/volley", "tcp/no.such.host.invalid:7447", "tcp/192.0.2.1:7447"]
)
def test_an_endpoint_that_cannot_be_checked_counts_as_free(endpoint: str):
    """Zenoh reports what is wrong with it."""
    assert not is_taken(endpoint)


def test_the_name_of_the_robot(tmp_path: Path):
    """The name is the flag's or the robot config's; the model is not read for it."""
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
    """The robot's name is the second part of every key."""
    for flag, name in ((None, "arm"), ("left", "left")):
        with open_bus(Options(robot=flag, listen=(router,)), "arm") as bus:
            assert bus.key("goal") == f"volley/{name}/goal"


def test_a_bad_zenoh_config_is_an_error(tmp_path: Path, router: str):
    """Zenoh's own error is raised, without waiting for a router."""
    path = tmp_path / "bad.json5"
    path.write_text('{ "mode": "captain" }')
    with pytest.raises(zenoh.ZError):
        open_bus(Options(connect=(router,), zenoh_config=path), "arm")
