"""`volley`: one shell command, with a subcommand for each task."""

import importlib
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

DONE, REFUSED, USAGE, SILENT, INTERRUPTED, PIPE_CLOSED = 0, 1, 2, 4, 130, 141


@dataclass(frozen=True, slots=True)
class Command:
    """One subcommand.

    Attributes:
        target: MODULE:FUNCTION, imported only when the command is run.
        about: Line in the list of commands.
        is_main: The function is the `main` of a program, which reads `sys.argv`.
    """

    target: str
    about: str
    is_main: bool = False

    def load(self) -> Callable[..., int | None]:
        """Import and return the function."""
        module, _, function = self.target.partition(":")
        return getattr(importlib.import_module(module), function)


GROUPS: dict[str, dict[str, Command]] = {
    "start": {
        "robot": Command("tools.shell.robot:robot", "set up your own arm: import its model, check its description"),
        "up": Command("services.__main__:main", "start every service with one robot, until Ctrl-C", is_main=True),
        "demo": Command("tools.demo.__main__:main", "five strikes, a table and a trace", is_main=True),
        "rally": Command("tools.rally.__main__:main", "throw balls, which the arm returns", is_main=True),
        "drill": Command("tools.drill.__main__:main", "cause every fault and measure each reaction", is_main=True),
        "preflight": Command("tools.preflight.__main__:main", "check this machine for a 1 kHz loop", is_main=True),
    },
    "move": {
        "goal": Command("tools.shell.goal:goal", "play a primitive, to its own end or to another"),
        "execute": Command("tools.shell.motion:execute", "play a trajectory from a file"),
        "cancel": Command("tools.shell.motion:cancel", "stop the motion"),
        "reset": Command("tools.shell.motion:reset", "leave a latched fault"),
        "hold": Command("tools.shell.arm:hold", "move a gripper or other held joints"),
        "strike": Command("tools.shell.ball:strike", "return balls to a target, or stop with --stop"),
        "recover": Command("tools.shell.arm:recover", "make the arm ready again after a reflex or a stop"),
        "result": Command("tools.shell.motion:result", "show the result of a goal"),
    },
    "teach": {
        "primitives": Command("tools.shell.library:primitives", "list the library"),
        "learn": Command("tools.shell.recordings:learn", "learn a primitive from a recording"),
        "episodes": Command("tools.shell.recordings:episodes", "list the movements of a recording"),
        "teach": Command("tools.shell.teaching:teach", "learn a movement by guiding the arm, or from part of a trace"),
        "inspect": Command("tools.shell.inspection:inspect", "examine a recording and plot it, without learning"),
        "forget": Command("tools.shell.library:forget", "remove a primitive"),
        "export": Command("tools.shell.recordings:export", "write a played motion as CSV, NPZ, MCAP or LeRobot"),
    },
    "look": {
        "watch": Command("tools.shell.watch:watch", "show the live status, until Ctrl-C"),
        "status": Command("tools.shell.motion:status", "show the controller's mode, goal, errors and timing"),
        "state": Command("tools.shell.arm:state", "show the arm's measured state"),
        "description": Command("tools.shell.arm:description", "show the arm's joints, home, limits and clock"),
        "reference": Command("tools.shell.motion:reference", "show the reference trajectory, now or at a later time"),
    },
    "simulate": {
        "reset-sim": Command("tools.shell.arm:reset_sim", "start a new run: arm at rest, ball on its tee"),
        "step": Command("tools.shell.arm:step", "advance the stepped clock"),
        "ball": Command("tools.shell.ball:ball", "throw the ball, in the present run"),
        "drag": Command("tools.shell.dragging:drag", "open a window in which the mouse drags the arm"),
        "disturb": Command("tools.shell.arm:disturb", "push the arm, add sensor noise, drop messages"),
    },
}
COMMANDS: dict[str, Command] = {name: command for group in GROUPS.values() for name, command in group.items()}


def main(words: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit status; print errors to stderr, one sentence each."""
    try:
        try:
            return dispatch(words)
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:  # as in `volley goal --help | head`; at exit Python flushes and would report it again
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PIPE_CLOSED


def dispatch(words: Sequence[str] | None) -> int:
    """Run the command that the first word names."""
    name, *rest = [*(sys.argv[1:] if words is None else words)] or ["--help"]
    if name in ("-h", "--help"):
        print(usage())
        return DONE
    if name not in COMMANDS:
        print(f"volley: there is no command {name!r}; volley --help lists them", file=sys.stderr)
        return USAGE
    command = COMMANDS[name]
    if command.is_main:
        sys.argv = [f"volley {name}", *rest]
        return command.load()() or DONE
    return run(name, command.load(), rest)


def run(name: str, function: Callable[..., int | None], words: Sequence[str]) -> int:
    """Run a command that is not a program of its own, and return its exit status."""
    import tyro

    from client import NoAnswer, NoRouter, Refusal
    from tools.shell.shell import UsageError, refusal_json

    style = (tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff, tyro.conf.DisallowNone)
    try:
        return tyro.cli(function, prog=f"volley {name}", args=list(words), config=style) or DONE
    except Refusal as refusal:
        print(refusal_json(refusal) if "--json" in words else f"{refusal.code}: {refusal}", file=sys.stderr)
        return REFUSED
    except UsageError as error:
        print(error, file=sys.stderr)
        return USAGE
    except (NoAnswer, NoRouter, TimeoutError) as error:
        print(error, file=sys.stderr)
        return SILENT


def usage() -> str:
    """Return the list of commands."""
    width = max(map(len, COMMANDS))
    lines = ["usage: volley COMMAND [--help] ...", ""]
    for group, commands in GROUPS.items():
        lines += [f"{group}:", *(f"  {name:{width}}  {command.about}" for name, command in commands.items()), ""]
    lines.append("volley COMMAND --help describes the command.")
    lines.append("Exit status: 0 success; 1 refused or failed; 2 wrong usage; 4 no reply; 130 interrupted.")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
