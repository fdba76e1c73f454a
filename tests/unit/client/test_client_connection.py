"""Connecting to a bus, and the errors if there is no router or no answer."""

import asyncio
import subprocess
import sys

import pytest
import zenoh

from client import NoAnswer, NoRouter, connect, connect_async


def test_a_missing_router_is_an_error():
    with pytest.raises(NoRouter, match=r"^no router at tcp/127\.0\.0\.1:1: start the robot with volley up, or name"):
        connect("tcp/127.0.0.1:1")

    async def join() -> None:
        async with connect_async("tcp/127.0.0.1:1"):
            pass

    with pytest.raises(NoRouter):
        asyncio.run(join())


def test_a_malformed_endpoint_is_an_error():
    with pytest.raises(ValueError, match=r"^'localhost:7447' is not an endpoint; write tcp/HOST:PORT"):
        connect("localhost:7447")


@pytest.mark.parametrize("name", ["", "*", "a*"])
def test_an_invalid_robot_name_is_an_error(name, robot):
    """The name is refused before anything is sent: any robot would answer a wildcard."""
    with pytest.raises(ValueError, match="cannot be a part of a key"):
        connect(robot.endpoint, robot=name)


def test_a_configuration_must_have_an_endpoint(tmp_path, robot):
    file = tmp_path / "operator.json5"
    with pytest.raises(ValueError, match=r"operator\.json5 is not a Zenoh configuration"):
        connect(config=file)
    file.write_text("{}")
    with pytest.raises(ValueError, match="names no endpoint to connect to"):
        connect(config=file)
    file.write_text(
        f'{{mode: "peer", connect: {{endpoints: ["{robot.endpoint}"]}}, listen: {{endpoints: ["tcp/[::]:0"]}}}}'
    )
    with connect(config=file) as arm:
        assert arm.status().mode == "tracking"


def test_a_missing_answer_has_its_reason(router, robot):
    with connect(robot.endpoint, "leg") as leg:
        with pytest.raises(NoAnswer, match=r"the controller is not running, or not on this bus; start .* volley up$"):
            leg.status()
        router.bus.announce("sim")
        with pytest.raises(NoAnswer, match=r"no robot has the name 'leg' on this bus; choose from 'arm'$"):
            leg.status()
    robot.silent.add("status")
    with connect(robot.endpoint, timeout=0.2) as arm:
        with pytest.raises(NoAnswer, match=r"the controller is not running; these services run: sim$"):
            arm.status()
        router.bus.announce("controller")
        with pytest.raises(NoAnswer, match=r"the controller runs, but sent no reply$"):
            arm.status()


def test_a_closed_connection_is_an_error(robot):
    with connect(robot.endpoint) as arm:
        pass
    with pytest.raises(NoAnswer, match=r"this connection is closed$"):
        arm.status()


def test_a_lease_that_could_not_begin_is_not_held(robot):
    arm = connect(robot.endpoint)
    arm.close()
    with pytest.raises(zenoh.ZError), arm.lease():
        pass
    assert not arm.holds_lease


def test_the_client_imports_only_the_protocol():
    code = "import sys, client; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    others = {"motion", "robot", "services", "tools", "mujoco", "rerun", "scipy", "piqp", "tyro", "rich"}
    late = {"numpy", "asyncio"}  # imported only where they are needed, so that a command starts quickly
    assert not (others | late) & set(loaded)


SLOW_END_OF_REPLIES = """
import sys, time
from client import connect
from client.mailboxes import BlockingMailbox

put = BlockingMailbox.put

def put_and_wait(self, item):
    put(self, item)
    if item is None:
        time.sleep(0.3)

BlockingMailbox.put = put_and_wait
with connect(sys.argv[1]) as arm:
    arm.robots()
    assert arm.status().mode == "tracking"
"""


def test_a_request_after_a_search_for_robots_never_waits_for_zenohs_lock(robot):
    """Zenoh ends a liveliness query under a lock for which `is_closed` waits with the interpreter's lock held."""
    command = [sys.executable, "-c", SLOW_END_OF_REPLIES, robot.endpoint]
    done = subprocess.run(command, capture_output=True, text=True, timeout=20, check=False)
    assert (done.returncode, done.stderr) == (0, "")
