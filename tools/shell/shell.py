"""What all commands share: their flags, the way to the bus, and the way to the screen."""

import json
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Annotated

import msgspec
import tyro
import zenoh
from rich.console import Console
from rich.text import Text

from protocol import messages as m
from protocol.bus.bus import Bus
from protocol.bus.sessions import DEFAULT_ENDPOINT
from protocol.errors import NoAnswer, Refusal
from protocol.topics import DESCRIPTION, Query, ReplyT, RequestT
from services.common.cli import Common, Options, open_bus
from tools.shell.show import show

HUB_WAIT_S = 2.0
PIPE_WIDTH = 140


class UsageError(Exception):
    """Flags that cannot be meant; `str()` is a sentence that names the flag."""


class NoBus(Exception):
    """Nobody hosts the bus."""


@dataclass(frozen=True, slots=True)
class Flags:
    """Flags of every command.

    Attributes:
        json: Print the reply as one line of JSON, fields as in docs/protocol.md, matrices in base64.
        timeout: Wait for the reply this long, s; by default as long as the request deserves.
    """

    common: Common = field(default_factory=Options)
    json: bool = False
    timeout: float | None = None


Shared = Annotated[Flags, tyro.conf.arg(name="")]
"""`Flags` without prefix, as a parameter of a command."""


@dataclass(slots=True)
class Shell:
    """One command's way to the bus and to the screen. `joint_names` is empty where nobody describes the arm."""

    bus: Bus
    flags: Flags
    console: Console
    _description: m.Description | None = None
    _described: bool = False

    def ask(self, topic: Query[RequestT, ReplyT], request: RequestT) -> ReplyT:
        """Send a request and return the reply.

        Raises:
            Refusal: the owner refused.
            NoAnswer: there is no owner, or it is silent.
        """
        return self.bus.ask(topic, request, self.flags.timeout)

    def description(self) -> m.Description | None:
        """What the arm is, or None where nobody says: a planner may be alone on its bus."""
        if not self._described:
            self._described = True
            try:
                self._description = self.bus.ask(DESCRIPTION, m.Empty(), timeout=1.0)
            except (NoAnswer, Refusal):
                self._description = None
        return self._description

    def print(self, reply: msgspec.Struct) -> None:
        """Print a reply as a table or sentence, or with --json as it is."""
        if self.flags.json:
            self.console.print(Text(msgspec.json.encode(reply).decode()), soft_wrap=True)
        else:
            description = self.description()
            self.console.print(show(reply, description.joint_names if description else []))

    def exchange(self, topic: Query[RequestT, ReplyT], request: RequestT) -> None:
        """Send a request and print the reply."""
        self.print(self.ask(topic, request))


@contextmanager
def reach(flags: Flags) -> Iterator[Shell]:
    """Join the bus for one command.

    Raises:
        NoBus: nobody hosts it.
        UsageError: the configuration cannot be used.
    """
    deadline = time.monotonic() + HUB_WAIT_S
    options = flags.common
    try:
        bus = open_bus(options, robot_name(options), give_up=lambda: time.monotonic() > deadline)
    except zenoh.ZError as error:
        if "Unable to connect" not in str(error):
            raise UsageError(f"the bus cannot be joined: {error}") from None
        where = " or ".join(options.connect) or str(options.zenoh_config or DEFAULT_ENDPOINT)
        hint = "start the robot with python -m services, or name another bus with --connect"
        raise NoBus(f"nobody hosts a bus at {where}; {hint}") from None
    console = Console()
    if not console.is_terminal:
        console.width = PIPE_WIDTH
    with bus:
        yield Shell(bus, flags, console)


def robot_name(options: Options) -> str:
    """Return the robot's name on the bus: the flag's, or the one in the robot config.

    Raises:
        UsageError: the configuration cannot be read.
    """
    if options.robot:
        return options.robot
    try:
        return str(tomllib.loads(options.robot_config.read_text())["name"])
    except (OSError, KeyError, tomllib.TOMLDecodeError) as error:
        raise UsageError(f"--robot-config {options.robot_config} does not name a robot: {error}") from None


def refusal_json(refusal: Refusal) -> str:
    """Return a refusal as it came, one line of JSON."""
    return json.dumps({"code": refusal.code, "message": refusal.message, "detail": refusal.detail})
