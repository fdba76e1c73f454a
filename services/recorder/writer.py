"""Write a trace to a file, a live viewer or both: rows on timelines, scalars, events and lanes."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb

from services.recorder.entities import Entity

Numbers = Sequence[Any] | np.ndarray

APPLICATION = "volley"
SCALARS = rr.Scalars.descriptor_scalars()
LIVE_MEMORY = "256MiB"
"""Buffer of the viewer server for viewers that connect later; the oldest data are dropped first."""


@dataclass(frozen=True, slots=True)
class Live:
    """The viewer server: loopback only."""

    port: int

    @property
    def uri(self) -> str:
        """The address for `rerun` to connect to."""
        return f"rerun+http://127.0.0.1:{self.port}/proxy"


class Rows:
    """Times of N rows of the trace on the timelines.

    ticks: (N,) of the trace. wall_ns: (N,) Unix ns, None for rows without a wall time.
    """

    def __init__(self, ticks: Numbers, rate_hz: float, wall_ns: Numbers | None = None) -> None:
        self.ticks = np.asarray(ticks, dtype=np.int64)
        self._rate_hz = rate_hz
        self._wall_ns = None if wall_ns is None else np.asarray(wall_ns, dtype=np.int64)
        sim_time = np.rint(self.ticks * (1e9 / rate_hz)).astype(np.int64)
        self.columns = [
            rr.TimeColumn("sim_time", duration=sim_time.astype("timedelta64[ns]")),
            rr.TimeColumn("tick", sequence=self.ticks),
        ]
        if self._wall_ns is not None:
            self.columns.append(rr.TimeColumn("wall", timestamp=self._wall_ns.astype("datetime64[ns]")))

    def __len__(self) -> int:
        return len(self.ticks)

    def only(self, indices: Sequence[int]) -> "Rows":
        """Return some of the rows."""
        return Rows(self.ticks[indices], self._rate_hz, None if self._wall_ns is None else self._wall_ns[indices])


pa.set_memory_pool(pa.system_memory_pool())  # Arrow's own pool keeps hundreds of megabytes that Rerun's threads free


class _ScalarColumn(rr.ComponentColumn):
    """The column that `rr.Scalars.columns` makes of (N,) or (N, K) float64, in half the time.

    The recorder spends most of its time here.
    """

    def __init__(self, values: np.ndarray) -> None:
        self.descriptor = SCALARS
        self._values = values

    def as_arrow_array(self) -> pa.Array:
        width = self._values.shape[1] if self._values.ndim == 2 else 1
        offsets = np.arange(0, self._values.size + 1, width, dtype=np.int32)
        return pa.ListArray.from_arrays(offsets, pa.array(self._values.reshape(-1)))


class TraceWriter:
    """A trace being written to `file` (with an `index` at its end), served by `live`, or both."""

    def __init__(self, blueprint: rrb.Blueprint, file: Path | None, live: Live | None, index: bool = True) -> None:
        self.recording = rr.RecordingStream(APPLICATION)
        sinks: list[rr.FileSink | rr.GrpcServerSink] = []
        if file:
            sinks.append(rr.FileSink(file, write_footer=index))
        if live:
            sinks.append(rr.GrpcServerSink("127.0.0.1", live.port, server_memory_limit=LIVE_MEMORY))
        self.recording.set_sinks(*sinks, default_blueprint=blueprint)

    def flush(self) -> None:
        """Write the buffer."""
        self.recording.flush()

    def close(self) -> None:
        """Write the buffer and finish the file."""
        self.flush()
        self.recording.disconnect()

    def static(self, path: str, *what: rr.AsComponents) -> None:
        """Write static components, which hold at all times."""
        self.recording.log(path, *what, static=True)

    def send(self, path: str, rows: Rows, *columns: Iterable[rr.ComponentColumn]) -> None:
        """Write columns of components, as archetypes' `columns` make them."""
        self.recording.send_columns(path, rows.columns, [column for some in columns for column in some])

    def scalars(self, path: str, rows: Rows, values: Numbers) -> None:
        """Write (N,) or (N, K) numbers as float64."""
        self.recording.send_columns(path, rows.columns, [_ScalarColumn(np.asarray(values, dtype=np.float64))])

    def joints(self, entity: Entity, names: Sequence[str], rows: Rows, values: Numbers) -> None:
        """Write (N, J) numbers to an entity for each joint."""
        array = np.asarray(values, dtype=np.float64)
        for name, column in zip(names, np.ascontiguousarray(array.T), strict=True):
            self.scalars(entity.at(name), rows, column)

    def texts(self, path: str, rows: Rows, texts: Sequence[str], level: str = "INFO") -> None:
        """Write sentences to the log of events."""
        self.send(path, rows, rr.TextLog.columns(text=texts, level=[level] * len(rows)))

    def states(self, path: str, rows: Rows, states: Sequence[str | None]) -> None:
        """Write changes of a lane's state; None is a gap."""
        self.send(path, rows, rr.StateChange.columns(state=[state or "" for state in states]))

    def values(self, path: str, rows: Rows, **values: Any) -> None:
        """Write named values as they are."""
        self.send(path, rows, rr.AnyValues.columns(**values))
