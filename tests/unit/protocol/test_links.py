"""The socket options of connections."""

import socket
import struct

from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from services.common.cli import free_endpoint
from tests.connections import connections, port_of
from tests.waiting import eventually

BOTH_ENDS = [0, 0]


def test_no_connection_lingers_at_either_end():
    """Zenoh sets 10 s, in which its thread receives nothing; later connections are guarded as well."""
    endpoint = free_endpoint()
    port = port_of(endpoint)
    with Bus(open_session(listen=[endpoint])):
        for _ in range(2):
            with Bus(open_session([endpoint])):
                assert eventually(lambda: lingering(port) == BOTH_ENDS)


def lingering(port: int) -> list[int]:
    """Return for each end of a connection at a port whether it lingers when it is closed."""
    raw = [each.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8) for each in connections(port)]
    return [struct.unpack("ii", each)[0] for each in raw]
