"""Zenoh sessions with the project's defaults."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import zenoh

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
MAX_MESSAGE_BYTES = 32 << 20
"""Where Zenoh itself drops a message: twice the largest request, so that what is merely too large gets an answer."""
LEASE_MS, SERVICE_LEASE_MS = 2000, 20_000
"""After so much silence of a process that is stopped or cut off its session counts as lost (one that ends: at once).

A client may hold the arm, so it is missed soon. A service that is stopped is missed long before, by its silence, and
goes on where it was when it is continued: what was said to it meanwhile waits, as far as buffers go.
"""
NO_HUB = "Unable to connect"
"""What Zenoh's error says where no endpoint to connect to answers."""


def open_session(
    connect: Sequence[str] = (),
    listen: Sequence[str] = (),
    config_file: Path | None = None,
    give_up: Callable[[], bool] = lambda: False,
    lease_ms: int = LEASE_MS,
) -> zenoh.Session:
    """Open a session: the router of the bus where `listen` is given, otherwise a client of `connect`.

    A client waits and retries while no hub is there, asking `give_up` twice a second, and comes back by itself after
    one restarts. `config_file` (json5) is laid under the project's settings. Once the other end has heard nothing for
    `lease_ms`, it counts the session as lost.

    Raises:
        zenoh.ZError: the configuration is invalid, an endpoint to listen on is taken, or `give_up` said so.
    """
    config = session_config(connect, listen, config_file, lease_ms)
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            if listen or NO_HUB not in str(error) or give_up():
                raise


def session_config(
    connect: Sequence[str], listen: Sequence[str], config_file: Path | None, lease_ms: int = LEASE_MS
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
    config.insert_json5("transport/link/tx/lease", str(lease_ms))
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
