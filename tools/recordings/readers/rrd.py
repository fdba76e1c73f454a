"""Rerun recordings: the goals in a trace of Volley's recorder, or any entities with Scalars."""

import re
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from services.recorder.entities import GOAL_LANE, MEASURED_POSITION
from tools.recordings.recording import Episode, Recording, Unreadable, check_size, head
from tools.trace_reader import count_recordings, read_chunks

SCALARS = "Scalars:scalars"
SERIES = "SeriesLines:names", "SeriesPoints:names"
LOG_TIME = "log_time"
LOGGED = f"its times are those of {LOG_TIME}, when it was logged; if the arm did not move then, give --rate"
STATE = "StateChange:state"
TIMELINE = "sim_time"
MEASURED = re.compile(MEASURED_POSITION.path.replace("JOINT", "(.+)"))
NS = 1e-9


@dataclass(slots=True)
class _Series:
    """Times, ns, and values of one entity, chunk by chunk."""

    times: list[np.ndarray] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(map(len, self.times))


@dataclass(slots=True)
class Scan:
    """Content of a file: series by name, and the times, s, at which the goal of the reference changes."""

    series: dict[str, _Series] = field(default_factory=dict)
    changes: list[tuple[float, str]] = field(default_factory=list)
    is_trace: bool = False
    counters: set[str] = field(default_factory=set)
    """Integer timelines of scalars without times."""
    timelines: set[str] = field(default_factory=set)
    """Timelines that provided the times."""
    names: dict[str, list[str]] = field(default_factory=dict)
    """By the path of an entity, the names of its numbers that the viewer shows."""
    notes: tuple[str, ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the series: the entity, and for one of several numbers its name or index."""
        return tuple(self._column(name) for name in self.series)

    def _column(self, name: str) -> str:
        entity, bracket, index = name.removesuffix("]").partition("[")
        given = self.names.get(entity, []) if bracket else []
        count = sum(one.startswith(f"{entity}[") for one in self.series)
        return f"{entity}/{given[int(index)]}" if len(given) == count and count else name

    def goals(self) -> dict[str, tuple[float, float]]:
        """Return the start and end, s, of each goal of a trace."""
        changes = sorted(self.changes, key=lambda change: change[0])
        ends = ([time for time, _ in changes[1:]] + [np.inf])[: len(changes)]
        return {goal: (begin, end) for (begin, goal), end in zip(changes, ends, strict=True) if goal}

    def table(self) -> tuple[np.ndarray, np.ndarray]:
        """Return times (n,), s, and values (n, C), NaN for missing values."""
        joined = [(np.concatenate(one.times), np.concatenate(one.values)) for one in self.series.values()]
        times = np.unique(np.concatenate([stamps for stamps, _ in joined]))
        values = np.full((len(times), len(joined)), np.nan)
        for column, (stamps, numbers) in enumerate(joined):
            values[np.searchsorted(times, stamps), column] = numbers
        return times * NS, values


def episodes(path: Path, rate: float | None) -> list[Episode]:
    """Return the goals of a trace in their order, or the whole recording."""
    scan = scan_of(path)
    if not scan.series and scan.counters:
        raise Unreadable(
            f"{path} has Scalars without times, on {', '.join(sorted(scan.counters))}; log them with "
            "rr.set_time(NAME, duration=SECONDS)"
        )
    if not scan.series:
        return []
    times, _ = scan.table()
    goals = scan.goals() or {path.stem: (times[0], times[-1])}
    return [
        Episode(name, int(np.count_nonzero((begin <= times) & (times <= end))), float(min(end, times[-1]) - begin))
        for name, (begin, end) in goals.items()
    ]


def read(path: Path, episode: str, rate: float | None) -> Recording:
    """Return the measured positions during a goal, or the whole recording."""
    scan = scan_of(path)
    return _between(scan, *scan.goals().get(episode, (-np.inf, np.inf)), path, episode, rate)


def cut(path: Path, begin: float, end: float) -> Recording:
    """Return the measured positions between two times, s on the trace's clock.

    Raises:
        Unreadable: the file is not a trace of Volley's recorder, or has no samples between these times.
    """
    scan = _trace(path)
    taken = _between(scan, begin, end, path, "part", None)
    if not len(taken.times):
        times, _ = scan.table()
        raise Unreadable(f"{path} has no samples there: it lasts from {times[0]:.3f} to {times[-1]:.3f} s")
    return taken


def check_trace(path: Path) -> None:
    """Raise Unreadable if a file is not a trace of Volley's recorder, or no motion was played in it."""
    if not _trace(path).goals():
        raise Unreadable(f"{path} has no motion that was played; volley teach NAME --trace {path} learns from a part")


def _trace(path: Path) -> Scan:
    """Return what a trace of Volley's recorder has. Raises Unreadable for any other file."""
    try:
        is_rerun = head(path).startswith(b"RRF")
    except OSError as error:
        raise Unreadable(f"{path} cannot be read: {error.strerror}") from None
    if not is_rerun:
        raise Unreadable(f"{path} is not an .rrd file; name a trace of Volley's recorder")
    scan = scan_of(path)
    if not scan.is_trace:
        raise Unreadable(f"{path} is not a trace of Volley's recorder; learn it with volley learn {path}")
    return scan


def _between(scan: Scan, begin: float, end: float, path: Path, episode: str, rate: float | None) -> Recording:
    times, values = scan.table()
    inside = (begin <= times) & (times <= end)
    chosen = times[inside]
    check_size(path, episode, len(chosen))
    chosen = chosen - chosen[:1] if rate is None else np.arange(len(chosen)) / rate
    unit = "rad" if scan.is_trace else None
    logged = rate is None and scan.timelines == {LOG_TIME}
    notes = (*scan.notes, LOGGED) if logged else scan.notes
    return Recording(chosen, scan.columns, values[inside], unit, path, episode, rate is None, notes)


def scan_of(path: Path) -> Scan:
    """Return the content of a file, which is cached until the file changes, for `episodes` and `read`."""
    state = path.stat()
    return _scan(path, state.st_size, state.st_mtime_ns)


@lru_cache(maxsize=1)
def _scan(path: Path, _size: int, _changed_ns: int) -> Scan:
    """Read a file chunk by chunk, and keep positions and goals."""
    scan = Scan()
    if (count := count_recordings(path)) > 1:
        scan.notes = (f"the first of its {count} recordings is read; save the others in files of their own",)
    for chunk in read_chunks(path, static=True):
        if scan.is_trace and not _is_needed(chunk.entity_path):
            continue
        batch = chunk.to_record_batch()
        if SCALARS in batch.schema.names and not chunk.is_static:
            _add_scalars(scan, chunk.entity_path, batch, path)
        elif named := set(SERIES) & set(batch.schema.names):
            scan.names[chunk.entity_path.strip("/")] = batch.column(named.pop()).to_pylist()[-1] or []
        elif chunk.entity_path == GOAL_LANE.path and STATE in batch.schema.names:
            stamps, rows = batch.column(TIMELINE).cast(pa.int64()).to_numpy() * NS, batch.column(STATE).to_pylist()
            scan.changes += [(time, row[0]) for time, row in zip(stamps.tolist(), rows, strict=True) if row]
    return scan


def _is_needed(entity: str) -> bool:
    """Return whether a trace's episodes and positions are read from an entity; it has 30 times as many others."""
    return bool(MEASURED.fullmatch(entity)) or entity == GOAL_LANE.path


def _add_scalars(scan: Scan, entity: str, batch: pa.RecordBatch, path: Path) -> None:
    """Add the rows of a chunk; an entity with several numbers in a row becomes several series."""
    trace = MEASURED.fullmatch(entity)
    if trace and not scan.is_trace:
        scan.is_trace, scan.series = True, {}
    timeline = _timeline(batch)
    if timeline is None:
        scan.counters |= {one.name for one in batch.schema if pa.types.is_int64(one.type)}
    if timeline is None or (scan.is_trace and not trace):
        return
    scan.timelines.add(timeline)
    name = trace[1] if trace else entity.strip("/")
    rows = batch.column(SCALARS)
    offsets = rows.offsets.to_numpy()
    lengths = np.diff(offsets)
    width = int(lengths.max(initial=0))
    full = lengths == width
    times = batch.column(timeline).cast(pa.int64()).to_numpy()[full]
    flat, starts = np.asarray(rows.flatten(), dtype=float), (offsets[:-1] - offsets[0])[full]
    for index in range(width):
        found = scan.series.setdefault(name if width == 1 else f"{name}[{index}]", _Series())
        found.times.append(times)
        found.values.append(flat[starts + index])
        if not scan.is_trace:
            check_size(path, name, found.count)


def _timeline(batch: pa.RecordBatch) -> str | None:
    """Return the timeline of the samples: that of Volley's recorder, one of durations, or one of wall times."""
    durations = [field.name for field in batch.schema if pa.types.is_duration(field.type)]
    stamps = [field.name for field in batch.schema if pa.types.is_timestamp(field.type)]
    if TIMELINE in durations:
        return TIMELINE
    return next(iter([*durations, *sorted(stamps, key=lambda name: name == LOG_TIME)]), None)
