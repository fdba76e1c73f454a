"""Zenoh sessions with the project's defaults."""

import json
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import zenoh

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
MAX_MESSAGE_BYTES = 32 << 20
"""Where Zenoh itself drops a message: twice the largest request, so that what is merely too large gets an answer."""
STREAM_QUEUE = 16
"""Messages of a stream that wait for a socket, the most Zenoh allows: with its own 2, a stall of 3 ms loses one at
1 kHz."""
NO_HUB = "Unable to connect"
"""What Zenoh's error says where no endpoint to connect to answers."""


@dataclass(frozen=True, slots=True)
class SessionTimeouts:
    """How a process that is stopped or cut off is treated (one that ends is missed at once).

    Attributes:
        lease_ms: After so much silence its session counts as lost.
        backlog_bytes: Receive buffer, which keeps what is said meanwhile; where 0, or more than the kernel grants,
            the kernel's own.
    """

    lease_ms: int
    backlog_bytes: int = 0

    @property
    def is_granted(self) -> bool:
        """Whether the kernel lets a socket hold the backlog, of which it counts twice the bytes.

        To ask for more than it grants would end its own tuning.
        """
        if not self.backlog_bytes:
            return False
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, self.backlog_bytes)
            return probe.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) >= 2 * self.backlog_bytes


CLIENT = SessionTimeouts(lease_ms=2000)
"""A client may hold the arm, so it is missed soon."""
SERVICE = SessionTimeouts(lease_ms=20_000)
"""A service that is stopped is missed long before, by its silence, and goes on where it was when it is continued."""
RECORDER = replace(SERVICE, backlog_bytes=4 << 20)
"""A trace shall have no gap because the recorder was stopped: with what the host of the bus keeps, this lasts for 12 s
of 600 kB each."""


def open_session(
    connect: Sequence[str] = (),
    listen: Sequence[str] = (),
    config_file: Path | None = None,
    give_up: Callable[[], bool] = lambda: False,
    patience: SessionTimeouts = CLIENT,
) -> zenoh.Session:
    """Open a session: the router of the bus where `listen` is given, otherwise a client of `connect`.

    A client waits and retries while no hub is there, asking `give_up` twice a second, and comes back by itself after
    one restarts. `config_file` (json5) is laid under the project's settings; `patience` goes to the other end.

    Raises:
        zenoh.ZError: the configuration is invalid, an endpoint to listen on is taken, or `give_up` said so.
    """
    config = session_config(connect, listen, config_file, patience)
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            if listen or NO_HUB not in str(error) or give_up():
                raise


def session_config(
    connect: Sequence[str], listen: Sequence[str], config_file: Path | None, patience: SessionTimeouts = CLIENT
) -> zenoh.Config:
    """Return the configuration of such a session: no multicast scouting, no shared memory, bounded messages.

    Raises:
        zenoh.ZError: the configuration is invalid.
    """
    config = zenoh.Config.from_file(config_file) if config_file else zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/delay", "0")  # a router that scouts for nobody need not wait for who answers
    config.insert_json5("transport/shared_memory/enabled", "false")
    config.insert_json5("transport/link/rx/max_message_size", str(MAX_MESSAGE_BYTES))
    config.insert_json5("transport/link/tx/lease", str(patience.lease_ms))
    config.insert_json5("transport/link/tx/queue/size/real_time", str(STREAM_QUEUE))
    if patience.is_granted:
        for link in ("tcp", "tls"):
            config.insert_json5(f"transport/link/{link}/so_rcvbuf", str(patience.backlog_bytes))
    retry = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5}
    config.insert_json5("connect/retry", json.dumps(retry))
    attempt_ms = -1 if listen else 500  # a client's own wait for ever would ignore signals
    config.insert_json5("connect/timeout_ms", str(attempt_ms))
    config.insert_json5("connect/exit_on_failure", "false")
    if listen:
        config.insert_json5("mode", '"router"')
        config.insert_json5("listen/endpoints", json.dumps(list(listen)))
        config.insert_json5("listen/exit_on_failure", "true")
    elif not config_file or connect:
        config.insert_json5("mode", '"client"')
        config.insert_json5("listen/endpoints", "[]")
    if connect:
        config.insert_json5("connect/endpoints", json.dumps(list(connect)))
    return config
