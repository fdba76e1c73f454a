"""`volley`: one command for all that people do with a robot from the shell."""

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
        target: MODULE:FUNCTION, imported when the command is run and not before.
        about: What it does, in a line.
        is_main: The function is a program's own `main`, which reads `sys.argv`.
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
        "robot": Command("tools.shell.robot:robot", "bring your own arm: import its model, check its description"),
        "up": Command("services.__main__:main", "start every service with one robot, until Ctrl-C", is_main=True),
        "demo": Command("tools.demo.__main__:main", "five strikes, a table and a trace", is_main=True),
        "rally": Command("tools.rally.__main__:main", "balls are thrown, and the arm returns them", is_main=True),
        "drill": Command("tools.drill.__main__:main", "cause every fault, measure each reaction", is_main=True),
        "preflight": Command("tools.preflight.__main__:main", "what this machine promises a 1 kHz loop", is_main=True),
    },
    "move": {
        "goal": Command("tools.shell.goal:goal", "play a primitive, to its own end or to yours"),
        "execute": Command("tools.shell.motion:execute", "play a trajectory from a file"),
        "cancel": Command("tools.shell.motion:cancel", "stop the motion"),
        "reset": Command("tools.shell.motion:reset", "leave a latched fault"),
        "hold": Command("tools.shell.arm:hold", "lead a gripper, or other held joints, to new values"),
        "strike": Command("tools.shell.ball:strike", "return the balls that come to a target, or stop with --stop"),
        "recover": Command("tools.shell.arm:recover", "make the arm ready again after a reflex or a stop"),
        "result": Command("tools.shell.motion:result", "how a goal went"),
    },
    "teach": {
        "primitives": Command("tools.shell.library:primitives", "list the library"),
        "learn": Command("tools.shell.recordings:learn", "learn a primitive from a recording, of any format"),
        "episodes": Command("tools.shell.recordings:episodes", "list the movements of a recording"),
        "teach": Command("tools.shell.teaching:teach", "guide the arm through a movement, or cut it out of a trace"),
        "inspect": Command("tools.shell.inspection:inspect", "what is wrong with a recording, and a picture of it"),
        "forget": Command("tools.shell.library:forget", "remove a primitive"),
        "export": Command("tools.shell.recordings:export", "write a played motion as CSV, NPZ, MCAP or LeRobot"),
    },
    "look": {
        "watch": Command("tools.shell.watch:watch", "the live status, until Ctrl-C"),
        "status": Command("tools.shell.motion:status", "the controller at a glance"),
        "state": Command("tools.shell.arm:state", "what the arm measures"),
        "description": Command("tools.shell.arm:description", "what the arm is: joints, home, limits, clock"),
        "reference": Command("tools.shell.motion:reference", "where the arm will be"),
    },
    "simulate": {
        "reset-sim": Command("tools.shell.arm:reset_sim", "begin a new run: the arm at rest, the ball on its tee"),
        "step": Command("tools.shell.arm:step", "advance the stepped clock"),
        "ball": Command("tools.shell.ball:ball", "throw the ball, in the run that goes on"),
        "drag": Command("tools.shell.dragging:drag", "a window in which the mouse drags the arm"),
        "disturb": Command("tools.shell.arm:disturb", "push the arm, blur its sensors, lose messages"),
    },
}
COMMANDS: dict[str, Command] = {name: command for group in GROUPS.values() for name, command in group.items()}


def main(words: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit status; errors go to stderr as a sentence."""
    try:
        try:
            return dispatch(words)
        finally:
            sys.stdout.flush()
    except BrokenPipeError:  # as in `volley goal --help | head`; Python would report it again when it flushes at exit
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
    """Run a command of the shell's own and return its exit status."""
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
    except KeyboardInterrupt:
        return INTERRUPTED


def usage() -> str:
    """Return the list of commands."""
    width = max(map(len, COMMANDS))
    lines = ["usage: volley COMMAND [--help] ...", ""]
    for group, commands in GROUPS.items():
        lines += [f"{group}:", *(f"  {name:{width}}  {command.about}" for name, command in commands.items()), ""]
    lines.append("volley COMMAND --help says more.")
    lines.append("Exit status: 0 done; 1 refused, or did not succeed; 2 wrong usage; 4 no answer; 130 interrupted.")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
