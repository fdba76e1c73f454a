"""Counts tracebacks in reference cycles, which a process with a disabled garbage collector never frees.

At its exit the process writes their number to PID.tracebacks, in the directory of the `sitecustomize.py` that imported
this module.
"""

import atexit
import gc
import os
import sys
from pathlib import Path
from types import TracebackType

_disable = gc.disable


def disable_and_keep() -> None:
    """Disable the collector; what it finds at the end is then counted instead of freed."""
    _disable()
    gc.set_debug(gc.DEBUG_SAVEALL)


def write_count(directory: Path) -> None:
    """Write the number of tracebacks that only the collector would have freed."""
    gc.collect()
    count = sum(isinstance(kept, TracebackType) for kept in gc.garbage)
    (directory / f"{os.getpid()}.tracebacks").write_text(str(count))


gc.disable = disable_and_keep
atexit.register(write_count, Path(str(sys.modules["sitecustomize"].__file__)).parent)
