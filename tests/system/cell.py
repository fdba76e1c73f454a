"""A robot cell over TLS: certificates, configurations, and sessions of every role.

The sessions have a service's timeouts, so a stall of the test process does not end them.
"""

import json
from pathlib import Path

from deploy.zenoh.certificates import Authority, make_authority, make_certificate
from deploy.zenoh.configure import Cell, client_config, texts
from protocol.bus.bus import Bus
from protocol.bus.sessions import SERVICE, open_session
from services.common.cli import free_endpoint

STRANGERS = {"stranger": "stranger.arm", "neighbour": "controller.leg"}
"""Certificates that the right authority signed, by file; their common names are no roles of this robot."""


class SecureCell:
    """The files of a cell whose robot side listens on `host`, its certificate bearing the name `certified`."""

    def __init__(
        self, directory: Path, host: str = "127.0.0.1", port: int | None = None, certified: str | None = None
    ) -> None:
        self.tls = directory / "tls"
        port = port or int(free_endpoint().rpartition(":")[2])
        self.cell = Cell(out=directory / "zenoh", host=host, port=port, tls=self.tls)
        self.endpoint = f"tls/{host}:{port}"
        authority = Authority(self.tls, hosts=(certified or host,), days=1)
        make_authority(authority)
        self.cell.out.mkdir()
        for name, text in texts(self.cell).items():
            (self.cell.out / name).write_text(text)
        for file, common_name in STRANGERS.items():
            make_certificate(authority, file, common_name)
            self.write(file, client_config(self.cell, file))

    def file(self, name: str) -> Path:
        """Return the configuration of a role, a stranger, or the `router`."""
        return self.cell.out / f"{name}.json5"

    def write(self, name: str, config: dict) -> Path:
        """Write one more configuration and return its file."""
        self.file(name).write_text(json.dumps(config))
        return self.file(name)

    def host(self) -> Bus:
        """Host the bus with the permission table."""
        return Bus(open_session(listen=[self.endpoint], config_file=self.file("router"), timeouts=SERVICE))

    def join(self, role: str) -> Bus:
        """Join the bus as a role or as a stranger."""
        return Bus(open_session(config_file=self.file(role), timeouts=SERVICE))
