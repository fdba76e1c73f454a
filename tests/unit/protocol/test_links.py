"""What the kernel is told of connections."""

import contextlib
import socket
import struct
import time
from collections.abc import Iterator
from pathlib import Path

from protocol.bus import Bus
from protocol.sessions import open_session
from services.options import free_endpoint

BOTH_ENDS = [0, 0]


def port_of(endpoint: str) -> int:
    """Return the port in PROTOCOL/HOST:PORT."""
    return int(endpoint.rpartition(":")[2])


def connections(port: int) -> Iterator[socket.socket]:
    """Yield this process' sockets that are connected from or to a port."""
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


def test_no_connection_lingers_at_either_end():
    """Zenoh sets 10 s, in which its thread hears nobody; those that come back are guarded as well."""
    endpoint = free_endpoint()
    port = port_of(endpoint)
    with Bus(open_session(listen=[endpoint])):
        for _ in range(2):
            with Bus(open_session([endpoint])):
                end = time.monotonic() + 10.0
                lingering: list[int] = []
                while lingering != BOTH_ENDS and time.monotonic() < end:
                    raw = [each.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8) for each in connections(port)]
                    lingering = [struct.unpack("ii", each)[0] for each in raw]
                assert lingering == BOTH_ENDS
