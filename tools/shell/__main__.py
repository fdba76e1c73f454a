"""`python -m tools.shell`: every request of the wire contract from the shell."""

import sys
from collections.abc import Callable, Sequence

import tyro
from tyro.extras import SubcommandApp

from protocol.errors import NoAnswer, Refusal
from tools.shell import arm, library, motion
from tools.shell.goal import goal
from tools.shell.shell import NoBus, UsageError, refusal_json
from tools.shell.watch import watch

REFUSED, USAGE, SILENT, INTERRUPTED = 1, 2, 4, 130
HELP = """\
Ask a robot from the shell; COMMAND --help says more.

Exit status: 0 done; 1 refused, or a motion that was waited for did not succeed; 2 wrong usage; 4 no answer.
"""
COMMANDS: dict[str, Callable[..., int | None]] = {
    "goal": goal,
    "learn": library.learn,
    "primitives": library.primitives,
    "forget": library.forget,
    "execute": motion.execute,
    "cancel": motion.cancel,
    "reset": motion.reset,
    "result": motion.result,
    "reference": motion.reference,
    "status": motion.status,
    "watch": watch,
    "state": arm.state,
    "description": arm.description,
    "disturb": arm.disturb,
    "step": arm.step,
    "recover": arm.recover,
    "reset-sim": arm.reset_sim,
}


def main(words: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit status; errors go to stderr as a sentence."""
    words = sys.argv[1:] if words is None else words
    app = SubcommandApp()
    for name, command in COMMANDS.items():
        app.command(name=name)(command)
    try:
        return (
            app.cli(
                prog="python -m tools.shell",
                description=HELP,
                args=list(words),
                config=(tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff, tyro.conf.DisallowNone),
            )
            or 0
        )
    except Refusal as refusal:
        print(refusal_json(refusal) if "--json" in words else f"{refusal.code}: {refusal}", file=sys.stderr)
        return REFUSED
    except UsageError as error:
        print(error, file=sys.stderr)
        return USAGE
    except (NoAnswer, NoBus) as error:
        print(error, file=sys.stderr)
        return SILENT
    except KeyboardInterrupt:
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
