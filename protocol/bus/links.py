"""Connections that end with their peer: a cut cable must not block other connections."""

import contextlib
import os
import socket
import struct
from collections.abc import Generator
from pathlib import Path

import zenoh

NO_LINGER = struct.pack("ii", 0, 0)


def guard_links(session: zenoh.Session, timeout_ms: int) -> "zenoh.LinkEventsListener[None]":
    """Make every connection of `session`, present and future, end with its peer.

    When a peer's lease expires, Zenoh over TLS first waits until all written data is sent, for up to 15 minutes, during
    which the peer counts as alive. With these options the kernel ends a TLS connection whose peer acknowledges nothing
    for `timeout_ms`. Without them, Zenoh's receiving thread then blocks in `close` for 10 s, and with two dead peers
    the router receives nothing; with them `close` does not linger.
    """
    return session.info.declare_link_events_listener(
        lambda event: _guard(event.link, timeout_ms) if event.kind == zenoh.SampleKind.PUT else None, history=True
    )


def _guard(link: zenoh.Link, timeout_ms: int) -> None:
    """Set the options of the link's socket."""
    with contextlib.suppress(OSError), contextlib.closing(_sockets()) as sockets:
        for found in sockets:
            if _ports(found) == (_port(link.src), _port(link.dst)):
                found.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_LINGER)
                if link.src.startswith("tls/"):
                    found.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, timeout_ms)


def _sockets() -> Generator[socket.socket]:
    """Yield a copy of each socket of this process, and close it before the next."""
    for descriptor in Path("/proc/self/fd").iterdir():
        if not descriptor.is_socket():
            continue
        with contextlib.suppress(OSError):  # this one may be gone by now
            copy = os.dup(int(descriptor.name))
            try:
                found = socket.socket(fileno=copy)
            except OSError:
                os.close(copy)
                raise
            with found:
                yield found


def _ports(found: socket.socket) -> tuple[int, int] | None:
    """Return the ports of both ends, or None if the socket has none."""
    try:
        return found.getsockname()[1], found.getpeername()[1]
    except (OSError, IndexError):
        return None


def _port(locator: str) -> int:
    """Return the port of PROTOCOL/HOST:PORT, or -1 without a port."""
    port = locator.partition("?")[0].partition("#")[0].rpartition(":")[2]
    return int(port) if port.isdigit() else -1
