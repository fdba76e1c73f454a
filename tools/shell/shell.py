"""Shared by all commands: flags, the link to the robot, and output."""

import json
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Annotated

import msgspec
import tyro
from rich.text import Text

from client import ROBOT, Arm, GoalHandle, MotionHandle, NoAnswer, Refusal, connect
from client.link import unknown_robot
from protocol import messages as m
from tools.shell.console import ShellConsole
from tools.shell.flags import Endpoints, File, Seconds, Switch
from tools.shell.show import show


class UsageError(Exception):
    """The flags are wrong; `str()` is a sentence that names the flag."""


@dataclass(frozen=True, slots=True)
class Flags:
    """Flags of every command.

    Attributes:
        connect: Endpoint of the router, tcp/HOST:PORT; by default tcp/127.0.0.1:7447, or those in --zenoh-config.
        robot: Name of the robot on the bus.
        zenoh_config: A Zenoh configuration with certificates, a json5 file.
        json: Print the reply as one line of JSON, fields as in docs/protocol.md, matrices in base64.
        timeout: Timeout of the reply, s; by default one that suits the request.
    """

    connect: Endpoints = ()
    robot: Annotated[str, tyro.conf.arg(metavar="NAME")] = ROBOT
    zenoh_config: File = None
    json: Switch = False
    timeout: Seconds = None

    @property
    def words(self) -> list[str]:
        """The flags with which another command reaches the same robot."""
        words = [word for endpoint in self.connect for word in ("--connect", endpoint)]
        words += ["--robot", self.robot] if self.robot != ROBOT else []
        return words + (["--zenoh-config", str(self.zenoh_config)] if self.zenoh_config else [])

    @property
    def way(self) -> str:
        """`words` as text, each after a space."""
        return "".join(f" {shlex.quote(word)}" for word in self.words)


Shared = Annotated[Flags, tyro.conf.arg(name="")]
"""`Flags` without prefix, as a parameter of a command."""


class Shell:
    """A command's link to the robot and its output.

    Attributes:
        arm: The robot.
        flags: Flags of the command.
        console: Standard output.
    """

    def __init__(self, arm: Arm, flags: Flags) -> None:
        self.arm = arm
        self.flags = flags
        self.console = ShellConsole()
        self._described: list[m.Description | None] = []

    def description(self) -> m.Description | None:
        """Return the arm's description, or None without a robot: a planner may be alone on its bus."""
        if not self._described:
            try:
                self._described = [self.arm.description()]
            except (NoAnswer, Refusal):
                self._described = [None]
        return self._described[0]

    def joint_names(self) -> list[str]:
        """Return the joints' names, or an empty list without a description."""
        description = self.description()
        return description.joint_names if description else []

    def print(self, reply: msgspec.Struct) -> None:
        """Print a reply as a table or sentence, or with --json as JSON."""
        if self.flags.json:
            self.console.print(Text(msgspec.json.encode(reply).decode()), soft_wrap=True)
        else:
            self.console.print(show(reply, self.joint_names()))

    def print_result(self, result: m.Result) -> int:
        """Print a goal's result and return the exit status, 0 if it succeeded."""
        self.print(result)
        return 0 if result.outcome == "succeeded" else 1

    def follow(self, motion: GoalHandle | MotionHandle) -> int:
        """Wait until a motion has ended, print its result and return the exit status, 0 if it succeeded.

        Raises:
            Refusal, NoAnswer: as `wait`.
        """
        waiting = self.console.status(f"goal {motion.goal_id} runs") if sys.stdout.isatty() else nullcontext()
        try:
            with waiting:
                result = motion.wait()
        except KeyboardInterrupt:
            leased = "its lease ends, and the controller stops it"
            means = leased if self.arm.holds_lease else f"it continues; stop it with: volley cancel {motion.goal_id}"
            print(f"goal {motion.goal_id} is no longer followed: {means}", file=sys.stderr)
            raise
        return self.print_result(result)


@contextmanager
def reach(flags: Flags, client_id: str = "") -> Iterator[Shell]:
    """Join the bus for one command.

    Raises:
        NoRouter: there is no router.
        UsageError: the endpoint or the configuration cannot be used, or the robots on the bus have other names.
    """
    try:
        arm = connect(
            flags.connect or None, flags.robot, config=flags.zenoh_config, client_id=client_id, timeout=flags.timeout
        )
    except ValueError as error:
        raise UsageError(str(error)) from None
    with arm:
        if (robots := arm.robots()) and flags.robot not in robots:
            raise UsageError(unknown_robot(flags.robot, robots))
        yield Shell(arm, flags)


def refusal_json(refusal: Refusal) -> str:
    """Return a refusal as one line of JSON."""
    return json.dumps({"code": refusal.code, "message": refusal.message, "detail": refusal.detail})
