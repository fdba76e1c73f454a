"""The flags that one service has for itself and `python -m services` hands on."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

DEFAULT_LIBRARY = Path.home() / ".local" / "share" / "volley" / "library"


@dataclass(frozen=True, slots=True)
class SimFlags:
    """Flags of the sim.

    Attributes:
        clock: realtime follows the wall clock; stepped advances on `sim/step` requests only.
        seed: Seed of the sensor noise; in stepped time it also names the first run.
    """

    clock: Literal["realtime", "stepped"] = "realtime"
    seed: int = 0


@dataclass(frozen=True, slots=True)
class PlannerFlags:
    """Flags of the planner.

    Attributes:
        library: Directory of the learned primitives; made on first start, with the shipped demonstrations learned.
        lead: Fixed time ahead of now at which a plan begins, s; by default it follows the time that planning takes.
    """

    library: Path = DEFAULT_LIBRARY
    lead: float | None = None


@dataclass(frozen=True, slots=True)
class RecorderFlags:
    """Flags of the recorder.

    Attributes:
        record: The trace to write; an existing file is overwritten. By default volley-DATE-TIME.rrd in the current
            directory, unless --live is given.
        unindexed: End the trace without the index by which viewers jump in it, and which takes 1 MB of memory a second
            until then: for recordings of hours. `rerun rrd optimize` adds it afterwards.
        live: Serve a live view on loopback, to be opened with `rerun`.
        live_port: Port of the live view.
    """

    record: Path | None = None
    unindexed: bool = False
    live: bool = False
    live_port: int = 9876
