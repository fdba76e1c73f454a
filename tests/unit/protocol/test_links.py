"""The socket options of connections."""

import socket
import struct
import time

from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from services.common.cli import free_endpoint
from tests.connections import connections, port_of

BOTH_ENDS = [0, 0]


def test_no_connection_lingers_at_either_end():
    """Zenoh sets 10 s, in which its thread receives nothing; later connections are guarded as well."""
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
