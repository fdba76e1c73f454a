"""Robot, planner and operator on three addresses over TLS, in network namespaces that this test makes and removes.

The cables end in a switch, a fourth namespace. The test cuts a cable there, so neither end sees its own interface go
down.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from cell import SecureCell

from robot.description import load_robot

HOSTS = {"robot": "10.77.0.1", "planner": "10.77.0.2", "operator": "10.77.0.3"}
PATIENCE_S = 60.0
SOON_S = 9.0
"""The lease of 2 s, the stop, and time for a slow machine; less than Zenoh's default lease of 10 s."""
HOME = load_robot().home.tolist()


def run(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a command that may fail."""
    return subprocess.run(words, check=False, capture_output=True, text=True)


class Network:
    """Namespaces `PREFIX-NAME`, each with one cable to the namespace `PREFIX-switch`."""

    def __init__(self, stack: ExitStack) -> None:
        self._prefix = f"volley{os.getpid()}"
        for name in ("switch", *HOSTS):
            self._do("ip", "netns", "add", self.name(name))
            stack.callback(run, "ip", "netns", "del", self.name(name))
            self.inside(name, "ip", "link", "set", "lo", "up")
        self.inside("switch", "ip", "link", "add", "bridge", "type", "bridge")
        self.inside("switch", "ip", "link", "set", "bridge", "up")
        for name, address in HOSTS.items():
            peer = ("peer", "name", "cable", "netns", self.name(name))
            self.inside("switch", "ip", "link", "add", name, "type", "veth", *peer)
            self.inside("switch", "ip", "link", "set", name, "master", "bridge", "up")
            self.inside(name, "ip", "address", "add", f"{address}/24", "dev", "cable")
            self.inside(name, "ip", "link", "set", "cable", "up")

    def name(self, host: str) -> str:
        """Return the name of a host's namespace."""
        return f"{self._prefix}-{host}"

    def inside(self, host: str, *words: str) -> None:
        """Run a command on a host; if it fails, skip the test, because this machine does not allow it."""
        self._do("ip", "netns", "exec", self.name(host), *words)

    def cable(self, host: str, state: str) -> None:
        """Cut a host's cable (`down`) or restore it (`up`).

        A machine that could lay the cables can do this, so failure is an error.
        """
        done = run("ip", "netns", "exec", self.name("switch"), "ip", "link", "set", host, state)
        assert done.returncode == 0, done.stderr

    @staticmethod
    def _do(*words: str) -> None:
        try:
            done = run(*words)
        except FileNotFoundError as error:
            pytest.skip(f"this machine has no {error.filename}")
        if done.returncode != 0:
            pytest.skip(f"this machine cannot {' '.join(words)}: {done.stderr.strip()}")


class Hosts:
    """The services on their hosts, and an operator on a third one."""

    def __init__(self, network: Network, cell: SecureCell, stack: ExitStack, library: Path) -> None:
        self.network = network
        self._stack = stack
        client = str(Path(__file__).parent / "remote_client.py")
        # With the clock `paced` the arm would wait for a subscriber whose cable is cut.
        sim = ("--clock", "realtime", "--listen", cell.endpoint, "--zenoh-config", cell.file("router"))
        self._start("robot", "-m", "services.sim", *sim)
        self._start("robot", "-m", "services.controller", "--zenoh-config", cell.file("controller"))
        flags = ("--zenoh-config", cell.file("planner"), "--library", library, "--lead", "0.3")
        self._start("planner", "-m", "services.planner", *flags)
        self._clients = {
            "operator": self._start("operator", client, cell.file("operator")),
            "robot": self._start("robot", client, cell.file("viewer")),
        }

    def _start(self, host: str, *words: str | Path) -> subprocess.Popen[str]:
        command = ("ip", "netns", "exec", self.network.name(host), sys.executable, *words)
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self._stack.callback(end, process)
        return process

    def ask(self, key: str, at: str = "operator", **fields: Any) -> Any:
        """Send a request from the client on host `at` and return its reply, None if it is refused or not answered."""
        client = self._clients[at]
        assert client.stdin and client.stdout
        client.stdin.write(json.dumps([key, fields]) + "\n")
        client.stdin.flush()
        return json.loads(client.stdout.readline())

    def eventually(self, key: str, at: str = "operator", **fields: Any) -> dict:
        """Repeat a request that changes nothing until there is a reply."""
        deadline = time.monotonic() + PATIENCE_S
        while (reply := self.ask(key, at, **fields)) is None:
            assert time.monotonic() < deadline, f"no answer to {key} within {PATIENCE_S} s"
            time.sleep(0.1)
        return reply

    def goal(self, duration: float, **fields: Any) -> str:
        """Send the arm home within `duration`, and return the id of the goal."""
        reply = self.ask("goal", primitive="forehand", positions=HOME, duration=duration, **fields)
        assert reply is not None
        return reply["goal_id"]

    def result(self, goal_id: str, at: str = "operator") -> dict:
        """Return how a goal ended, once it has."""
        while (result := self.eventually("result", at, goal_id=goal_id))["outcome"] == "running":
            time.sleep(0.1)
        return result

    def until_lost(self, service: str) -> None:
        """Wait until a service on another host is no longer alive for the robot's host."""
        deadline = time.monotonic() + PATIENCE_S
        while self.ask(f"alive/{service}", at="robot"):
            assert time.monotonic() < deadline, f"{service} is not lost after {PATIENCE_S} s"


def end(process: subprocess.Popen[str]) -> None:
    """Terminate a process; kill it if it does not end within 20 s."""
    process.terminate()
    try:
        process.communicate(timeout=20.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()


@pytest.fixture
def hosts(tmp_path: Path) -> Iterator[Hosts]:
    """Yield three hosts with running services, the controller holding."""
    with ExitStack() as stack:
        network = Network(stack)
        cell = SecureCell(tmp_path, host=HOSTS["robot"], port=7447)
        hosts = Hosts(network, cell, stack, tmp_path / "library")
        hosts.eventually("primitives")
        while (
            hosts.eventually("status")["mode"] != "holding"
        ):  # a stall while the services start may have made the arm brake
            hosts.ask("reset")
        yield hosts


@pytest.mark.realtime
def test_a_cable_cut_in_a_motion(hosts: Hosts):
    """The robot plays the accepted motion alone; planner and operator return before its end and work as before."""
    goal_id = hosts.goal(duration=20.0)
    for host in ("planner", "operator"):
        hosts.network.cable(host, "down")
    hosts.until_lost("planner")
    assert hosts.ask("status", at="robot")["goal_id"] == goal_id
    for host in ("planner", "operator"):
        hosts.network.cable(host, "up")
    hosts.eventually("primitives")
    assert hosts.ask("status")["goal_id"] == goal_id, "the planner came back only after the motion had ended"
    assert hosts.result(goal_id)["outcome"] == "succeeded"
    assert hosts.result(hosts.goal(duration=0.5))["outcome"] == "succeeded"


@pytest.mark.realtime
def test_a_cable_cut_that_loses_a_lease(hosts: Hosts):
    """The robot cancels a motion whose lease holder is cut off, although the planner's cable is intact."""
    hosts.ask("hold/alice")
    goal_id = hosts.goal(duration=15.0, client_id="alice", lease=True)
    hosts.network.cable("operator", "down")
    cut = time.monotonic()
    result = hosts.result(goal_id, at="robot")
    assert time.monotonic() - cut < SOON_S
    assert (result["outcome"], result["reason"]) == ("canceled", "client alice lost its lease")
    hosts.network.cable("operator", "up")
    hosts.eventually("primitives")
    again = hosts.goal(duration=0.5, client_id="alice", lease=True)
    assert hosts.result(again)["outcome"] == "succeeded", "the client's token did not come back with its cable"


@pytest.mark.realtime
def test_a_poor_network(hosts: Hosts):
    """Goals succeed with 5 ms of delay and 1 % of loss between planner, operator and robot."""
    for host in ("planner", "operator"):
        hosts.network.inside("switch", "tc", "qdisc", "add", "dev", host, "root", "netem", "delay", "5ms", "loss", "1%")
        hosts.network.inside(host, "tc", "qdisc", "add", "dev", "cable", "root", "netem", "delay", "5ms", "loss", "1%")
    for _ in range(3):
        assert hosts.result(hosts.goal(duration=0.5))["outcome"] == "succeeded"
