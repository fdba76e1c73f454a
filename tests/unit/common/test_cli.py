"""The shared flags."""

from pathlib import Path

import pytest
import tyro
import zenoh

from protocol.bus.sessions import open_session
from services.common.cli import Options, free_endpoint, open_bus


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
