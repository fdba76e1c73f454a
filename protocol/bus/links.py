"""Connections that end with their peer: a pulled cable must hold up nobody else."""

import contextlib
import os
import socket
import struct
from collections.abc import Generator
from pathlib import Path

import zenoh

NO_LINGER = struct.pack("ii", 0, 0)


def guard_links(session: zenoh.Session, patience_ms: int) -> "zenoh.LinkEventsListener[None]":
    """Let no connection of `session`, now or later, outlive its peer.

    Once a peer's lease is over, Zenoh over TLS first waits until all that was written is sent, up to 15 minutes in
    which the peer counts as alive; here the kernel ends a TLS connection whose other end takes nothing in for
    `patience_ms`. Then Zenoh's receiving thread blocks in `close` for 10 s, and with two dead peers the host of the
    bus hears nobody; here `close` does not linger.
    """
    return session.info.declare_link_events_listener(
        lambda event: _guard(event.link, patience_ms) if event.kind == zenoh.SampleKind.PUT else None, history=True
    )


def _guard(link: zenoh.Link, patience_ms: int) -> None:
    """Set the options of the link's socket."""
    with contextlib.suppress(OSError), contextlib.closing(_sockets()) as sockets:
        for found in sockets:
            if _ports(found) == (_port(link.src), _port(link.dst)):
                found.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_LINGER)
                if link.src.startswith("tls/"):
                    found.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, patience_ms)


def _sockets() -> Generator[socket.socket]:
    """Yield this process' sockets, each closed, as a copy, before the next."""
    for descriptor in Path("/proc/self/fd").iterdir():
        if not descriptor.is_socket():
            continue
        with contextlib.suppress(OSError):  # it may be gone by now, and the next ones not
            copy = os.dup(int(descriptor.name))
            try:
                found = socket.socket(fileno=copy)
            except OSError:
                os.close(copy)
                raise
            with found:
                yield found


def _ports(found: socket.socket) -> tuple[int, int] | None:
    """Return the ports of both ends, or None where it has none."""
    try:
        return found.getsockname()[1], found.getpeername()[1]
    except (OSError, IndexError):
        return None


def _port(locator: str) -> int:
    """Return the port in PROTOCOL/HOST:PORT, or -1."""
    port = locator.partition("?")[0].partition("#")[0].rpartition(":")[2]
    return int(port) if port.isdigit() else -1
