"""Socket options of connections."""

import socket
import struct

from protocol.bus.bus import Bus
from protocol.bus.sessions import open_session
from services.common.cli import free_endpoint
from tests.connections import connections, port_of
from tools.drill.harness.waiting import eventually

NO_LINGER = [0, 0]


def test_no_connection_lingers_at_either_end():
    """Zenoh's default of 10 s would block its receiving thread; the second connection is checked as well."""
    endpoint = free_endpoint()
    port = port_of(endpoint)
    with Bus(open_session(listen=[endpoint])):
        for _ in range(2):
            with Bus(open_session([endpoint])):
                assert eventually(lambda: lingering(port) == NO_LINGER)


def lingering(port: int) -> list[int]:
    """Return SO_LINGER's flag of every socket of this process that is connected at a port."""
    raw = [each.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8) for each in connections(port)]
    return [struct.unpack("ii", each)[0] for each in raw]
