"""`python -m services.common.web_viewer PARENT PORT URI`: Rerun's web viewer of a live view, on loopback.

It becomes the `rerun` program, and ends with process PARENT, even if that is killed. `rerun.serve_web_viewer` in the
recorder would need no process, but it listens on all interfaces.
"""

import ctypes
import importlib.util
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

PR_SET_PDEATHSIG = 1


def command_line(port: int, live_port: int) -> list[str]:
    """Return the command line of the viewer at `port` for a live view at `live_port`; its parent is the caller."""
    return [sys.executable, "-m", "services.common.web_viewer", str(os.getpid()), str(port), _uri(live_port)]


def address(port: int, live_port: int) -> str:
    """Return the viewer's URL."""
    return f"http://127.0.0.1:{port}/?url={quote(_uri(live_port), safe='')}"


def _uri(live_port: int) -> str:
    return f"rerun+http://127.0.0.1:{live_port}/proxy"


def _program() -> str:
    """Return the path of the program; `bin/rerun` is a script that starts it in a second process."""
    found = importlib.util.find_spec("rerun_cli")
    assert found is not None
    assert found.origin is not None
    return str(Path(found.origin).with_name("rerun"))


def main(words: Sequence[str]) -> None:
    """Become the viewer."""
    parent, port, uri = words
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != int(parent):  # the parent ended before it could be watched
        return
    line = [_program(), "--serve-web", "--bind", "127.0.0.1", "--web-viewer-port", port, uri]
    os.execve(line[0], line, {**os.environ, "CI": "true"})  # with CI set, rerun sends no usage data


if __name__ == "__main__":
    main(sys.argv[1:])
