"""Connect to a robot on the bus."""

import json
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import zenoh

from client.arms import Arm, AsyncArm
from client.link import Link
from client.mailboxes import AwaitedMailbox, BlockingMailbox, Mailbox
from protocol.bus.bus import Bus
from protocol.bus.sessions import DEFAULT_ENDPOINT, NO_ROUTER, open_session, read_config
from protocol.topics import check_robot_name

ROBOT = "arm"
"""The name of the robot that ships with Volley."""
TIMEOUT_S = 2.0
"""Timeout of the connection to a router."""


class NoRouter(ConnectionError):
    """There is no router at the endpoint."""


def connect(
    endpoint: str | Sequence[str] | None = None,
    robot: str = ROBOT,
    *,
    config: Path | str | None = None,
    client_id: str = "",
    timeout: float | None = None,
) -> Arm:
    """Connect to a robot; the end of the arm's `with` block disconnects.

    Args:
        endpoint: Endpoint of the router, tcp/HOST:PORT, or several of these; by default tcp/127.0.0.1:7447, or those
            of `config`.
        robot: The robot's name, the second part of every key.
        config: A Zenoh configuration (json5), for example with the certificates for a bus over TLS.
        client_id: Name of this client, which is published with its goals; by default `lease` chooses one.
        timeout: Timeout of replies, s; by default one that suits each request.

    Raises:
        NoRouter: there is no router at the endpoint.
        ValueError: the endpoint, the robot's name or the configuration cannot be used.
    """
    return Arm(_link(endpoint, robot, config, BlockingMailbox, client_id, timeout))


@asynccontextmanager
async def connect_async(
    endpoint: str | Sequence[str] | None = None,
    robot: str = ROBOT,
    *,
    config: Path | str | None = None,
    client_id: str = "",
    timeout: float | None = None,
) -> AsyncIterator[AsyncArm]:
    """Connect to a robot for an `async with` block; arguments and errors as `connect`."""
    import asyncio

    link = await asyncio.to_thread(_link, endpoint, robot, config, AwaitedMailbox, client_id, timeout)
    try:
        yield AsyncArm(link)
    finally:
        await asyncio.to_thread(link.close)


def _link(
    endpoint: str | Sequence[str] | None,
    robot: str,
    config: Path | str | None,
    mailbox: Callable[[int], Mailbox[Any]],
    client_id: str,
    timeout: float | None,
) -> Link:
    check_robot_name(robot)
    endpoints = _endpoints(endpoint, config)
    deadline = time.monotonic() + TIMEOUT_S
    file = Path(config) if config else None
    try:
        session = open_session(endpoints, (), file, give_up=lambda: time.monotonic() > deadline)
    except zenoh.ZError as error:
        where = " or ".join(endpoints)
        if NO_ROUTER not in str(error):
            raise ValueError(f"the bus at {where} cannot be joined: {error}") from None
        raise NoRouter(
            f"no router at {where}: start the robot with volley up, or name the endpoint of another"
        ) from None
    return Link(Bus(session, robot), mailbox, client_id, timeout)


def _endpoints(endpoint: str | Sequence[str] | None, config: Path | str | None) -> Sequence[str]:
    """Return the endpoints to connect to: the given ones, those of the configuration, or the default one."""
    configured = _configured(config) if config else []
    if endpoint is None and config is not None and not configured:
        raise ValueError(f"{config} names no endpoint to connect to; give one")
    given = [endpoint] if isinstance(endpoint, str) else list(endpoint or configured or [DEFAULT_ENDPOINT])
    if wrong := [each for each in given if "/" not in each]:
        raise ValueError(f"{wrong[0]!r} is not an endpoint; write tcp/HOST:PORT, for example {DEFAULT_ENDPOINT}")
    return given


def _configured(config: Path | str) -> Sequence[str]:
    """Return the endpoints that a Zenoh configuration connects to."""
    try:
        said = json.loads(read_config(config).get_json("connect/endpoints"))
    except zenoh.ZError as error:
        raise ValueError(str(error)) from None
    return said.get("client", []) if isinstance(said, dict) else said
