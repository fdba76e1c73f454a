"""Sockets of this process's sessions."""

import contextlib
import fcntl
import socket
import struct
import termios
from collections.abc import Iterator
from pathlib import Path


def port_of(endpoint: str) -> int:
    """Return the port in PROTOCOL/HOST:PORT."""
    return int(endpoint.rpartition(":")[2])


def connections(port: int) -> Iterator[socket.socket]:
    """Yield this process's sockets whose own or peer port is `port`."""
    for descriptor in Path("/proc/self/fd").iterdir():
        if descriptor.is_socket():
            with (
                contextlib.suppress(OSError),
                socket.fromfd(int(descriptor.name), socket.AF_INET, socket.SOCK_STREAM) as found,
            ):
                try:
                    ports = found.getsockname()[1], found.getpeername()[1]
                except (OSError, IndexError):
                    continue
                if port in ports:
                    yield found


def unread(descriptor: int) -> int:
    """Return how many bytes written to a Unix socket are still unread by its peer."""
    (count,) = struct.unpack("i", fcntl.ioctl(descriptor, termios.TIOCOUTQ, bytes(4)))
    return count
