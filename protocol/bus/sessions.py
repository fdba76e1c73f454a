"""Zenoh sessions with the project's settings."""

import contextlib
import json
import re
import socket
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import zenoh

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
MAX_MESSAGE_BYTES = 32 << 20
"""Size above which Zenoh drops a message: twice the largest request, so that a slightly larger one is refused."""
STREAM_QUEUE = 16
"""Samples of a stream queued for a socket, Zenoh's maximum: with its default of 2, a stall of 3 ms loses one sample at
1 kHz."""
BLOCKED_US, CLIENT_BLOCKED_US = 500_000, 5_000_000
"""How long a blocking message waits for a connection whose buffers are full, for example to a process that a debugger
has stopped; then the connection is closed. While a router waits for a subscriber, a paced arm waits too: for 10 s with
Zenoh's default of 5 s. Clients keep the default, because a request of 16 MiB does not fit into the buffers, and a
router beside busy programs may read nothing for 1 s."""
NO_ROUTER = "Unable to connect"
"""Part of Zenoh's error if no endpoint to connect to answers."""
_SOURCE = re.compile(r" at /\S+\.rs:\d+\.?")
_SETTING = re.compile(r'(?:Json5Err\(|JSON error: )Message \{ msg: "(.*)", location: .*\}\)?$')
"""Additions of Zenoh to its error messages: a line of its source, and how it read a setting."""


@dataclass(frozen=True, slots=True)
class SessionTimeouts:
    """Timeouts for a peer that is suspended or unreachable; a peer that exits is detected at once.

    Attributes:
        lease_ms: Silence after which its session counts as lost.
        backlog_bytes: Receive buffer for messages that arrive meanwhile; the kernel's default if 0 or more than the
            kernel grants.
        batch_bytes: Largest batch on the connection; larger messages are fragmented. Every waiting message occupies a
            buffer of this size.
    """

    lease_ms: int
    backlog_bytes: int = 0
    batch_bytes: int = 65_535

    @property
    def is_granted(self) -> bool:
        """Whether the kernel grants the backlog, for which it counts twice the bytes.

        Requesting more than it grants would switch off its automatic tuning of the buffer.
        """
        if not self.backlog_bytes:
            return False
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, self.backlog_bytes)
            return probe.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) >= 2 * self.backlog_bytes


CLIENT = SessionTimeouts(lease_ms=2000)
"""Short, because a client may have a lease."""
SERVICE = SessionTimeouts(lease_ms=20_000)
"""Long, because the silence of a suspended service is detected much earlier; it continues when it is resumed."""
RECORDER = replace(SERVICE, backlog_bytes=4 << 20, batch_bytes=4096)
"""A large backlog, so that a suspended recorder leaves no gap in the trace: with the router's queue for 12 s at 600 kB
a second. Small batches, because the recorder reads messages twice a second and thousands of them wait: with larger
batches they would occupy hundreds of megabytes."""


def open_session(
    connect: Sequence[str] = (),
    listen: Sequence[str] = (),
    config_file: Path | None = None,
    give_up: Callable[[], bool] = lambda: False,
    timeouts: SessionTimeouts = CLIENT,
) -> zenoh.Session:
    """Open a session: the router of the bus if `listen` is given, otherwise a client of `connect`.

    A client retries until it finds a router, and calls `give_up` twice a second meanwhile. It reconnects when the
    router restarts. The project's settings override those of `config_file` (json5); the other end applies the
    `timeouts`.

    Raises:
        zenoh.ZError: the configuration is invalid, an endpoint to listen on is taken, or `give_up` returned True.
    """
    config = session_config(connect, listen, config_file, timeouts)
    while True:
        try:
            with _plain_errors():
                return zenoh.open(config)
        except zenoh.ZError as error:
            if listen or NO_ROUTER not in str(error) or give_up():
                raise


@contextlib.contextmanager
def _plain_errors(beginning: str = "") -> Iterator[None]:
    """Raise the errors of Zenoh with a `beginning` and only their sentence."""
    try:
        yield
    except zenoh.ZError as error:
        raise zenoh.ZError(beginning + _SETTING.sub(r"\1", _SOURCE.sub("", str(error)))) from None


@_plain_errors()
def session_config(
    connect: Sequence[str], listen: Sequence[str], config_file: Path | None, timeouts: SessionTimeouts = CLIENT
) -> zenoh.Config:
    """Return the configuration of such a session: no multicast scouting, no shared memory, bounded messages.

    Raises:
        zenoh.ZError: the configuration is invalid.
    """
    config = read_config(config_file) if config_file else zenoh.Config()
    is_router = bool(listen) or config.get_json("mode") == '"router"'
    settings: dict[str, object] = {
        "scouting/multicast/enabled": False,
        "scouting/delay": 0,  # scouting is off, so there is nothing to wait for
        "transport/shared_memory/enabled": False,
        "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
        "transport/link/tx/lease": timeouts.lease_ms,
        "transport/link/tx/batch_size": timeouts.batch_bytes,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": (
            BLOCKED_US if is_router else CLIENT_BLOCKED_US
        ),
        "transport/link/tx/queue/size/real_time": STREAM_QUEUE,
        "connect/retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5},
        "connect/timeout_ms": -1 if listen else 500,  # a client that retried without end would ignore signals
        "connect/exit_on_failure": False,
    }
    if timeouts.is_granted:
        settings |= {f"transport/link/{link}/so_rcvbuf": timeouts.backlog_bytes for link in ("tcp", "tls")}
    if listen:
        settings |= {"mode": "router", "listen/endpoints": list(listen), "listen/exit_on_failure": True}
    elif not config_file or connect:
        settings |= {"mode": "client", "listen/endpoints": []}
    if connect:
        settings["connect/endpoints"] = list(connect)
    for name, value in settings.items():
        config.insert_json5(name, json.dumps(value))
    return config


def read_config(file: Path | str) -> zenoh.Config:
    """Return the Zenoh configuration in a file (json5).

    Raises:
        zenoh.ZError: the file has no configuration; the sentence names it.
    """
    with _plain_errors(f"{file} is not a Zenoh configuration: "):
        return zenoh.Config.from_file(file)
