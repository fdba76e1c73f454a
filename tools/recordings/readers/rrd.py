"""Rerun's recordings: the goals of a trace that Volley's recorder wrote, or any entities with Scalars."""

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from rerun.chunk import RrdReader

from services.recorder.entities import GOAL_LANE, MEASURED_POSITION
from tools.recordings.recording import Episode, Recording, Unreadable, check_size

SCALARS = "Scalars:scalars"
STATE = "StateChange:state"
TIMELINE = "sim_time"
MEASURED = re.compile(MEASURED_POSITION.path.replace("JOINT", "(.+)"))
NS = 1e-9


@dataclass(slots=True)
class _Series:
    """Times, ns, and values of one entity, in pieces."""

    times: list[np.ndarray] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(map(len, self.times))


def episodes(path: Path, rate: float | None) -> list[Episode]:
    """Return the goals that a trace shows, in their order; or the whole recording."""
    columns, times, _ = _table(path)
    goals = _goals(path)
    if not columns:
        return []
    if not goals:
        return [Episode(path.stem, len(times), float(times[-1] - times[0]))]
    return [
        Episode(goal, int(np.count_nonzero((begin <= times) & (times <= end))), float(min(end, times[-1]) - begin))
        for goal, (begin, end) in goals.items()
    ]


def read(path: Path, episode: str, rate: float | None) -> Recording:
    """Return measured positions during a goal, or all that the recording has."""
    columns, times, values = _table(path)
    goals = _goals(path)
    begin, end = goals.get(episode, (-np.inf, np.inf))
    inside = (begin <= times) & (times <= end)
    check_size(path, episode, int(np.count_nonzero(inside)))
    chosen, unit = times[inside], "rad" if goals else None
    if rate is not None:
        chosen = np.arange(len(chosen)) / rate
    elif len(chosen):
        chosen = chosen - chosen[0]
    return Recording(chosen, columns, values[inside], unit, path, episode, rate is None)


def _table(path: Path) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Return names, times (n,), s, and values (n, C) of the joint positions; NaN where an entity has no value."""
    series: dict[str, _Series] = {}
    timelines: dict[str, int] = {}
    ours = False
    for entity, batch in _chunks(path, SCALARS):
        trace = MEASURED.fullmatch(entity)
        if trace and not ours:
            ours, series = True, {}
        if ours and not trace:
            continue
        _add(series, timelines, trace[1] if trace else entity.strip("/"), batch, path)
    if not series:
        return (), np.zeros(0), np.zeros((0, 0))
    return _joined(series)


def _add(series: dict[str, _Series], timelines: dict[str, int], name: str, batch: pa.RecordBatch, path: Path) -> None:
    """Add a chunk's rows; an entity with several numbers a row becomes several columns."""
    timeline = _timeline(batch)
    if timeline is None:
        return
    rows = batch.column(SCALARS)
    lengths = np.diff(rows.offsets.to_numpy())
    width = int(lengths.max(initial=0))
    full = lengths == width
    if not width:
        return
    times = batch.column(timeline).cast(pa.int64()).to_numpy()[full]
    flat = np.asarray(rows.flatten(), dtype=float)
    starts = (rows.offsets.to_numpy() - rows.offsets[0].as_py())[:-1][full]
    for index in range(width):
        found = series.setdefault(name if width == 1 else f"{name}[{index}]", _Series())
        found.times.append(times)
        found.values.append(flat[starts + index])
        check_size(path, name, found.count)


def _timeline(batch: pa.RecordBatch) -> str | None:
    """Return the timeline of a chunk that has durations, the recorder's first, or one of wall times."""
    of = {kind: [f.name for f in batch.schema if kind(f.type)] for kind in (pa.types.is_duration, pa.types.is_timestamp)}
    durations, stamps = of[pa.types.is_duration], of[pa.types.is_timestamp]
    if TIMELINE in durations:
        return TIMELINE
    own = [name for name in stamps if name != "log_time"]
    return next(iter([*durations, *own, *stamps]), None)


def _joined(series: dict[str, _Series]) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    joined = {name: (np.concatenate(one.times), np.concatenate(one.values)) for name, one in series.items()}
    times = np.unique(np.concatenate([stamps for stamps, _ in joined.values()]))
    values = np.full((len(times), len(joined)), np.nan)
    for column, (stamps, numbers) in enumerate(joined.values()):
        values[np.searchsorted(times, stamps), column] = numbers
    return tuple(joined), (times - times[0]) * NS if False else times * NS, values


def _goals(path: Path) -> dict[str, tuple[float, float]]:
    """Return begin and end, s, of each goal of a trace."""
    changes: list[tuple[float, str]] = []
    for entity, batch in _chunks(path, STATE):
        if entity == GOAL_LANE.path and TIMELINE in batch.schema.names:
            times = batch.column(TIMELINE).cast(pa.int64()).to_numpy() * NS
            changes += [(time, row[0]) for time, row in zip(times.tolist(), batch.column(STATE).to_pylist()) if row]
    changes.sort(key=lambda change: change[0])
    ends = [time for time, _ in changes[1:]] + [np.inf]
    return {goal: (begin, end) for (begin, goal), end in zip(changes, ends, strict=True) if goal}


def _chunks(path: Path, component: str) -> Iterator[tuple[str, pa.RecordBatch]]:
    """Yield entity and rows of each chunk with a component, one at a time."""
    with warnings.catch_warnings():
        # A trace that is being written has no footer yet.
        warnings.simplefilter("ignore")
        for chunk in RrdReader(path).stream():
            if not chunk.is_static and component in (batch := chunk.to_record_batch()).schema.names:
                yield chunk.entity_path, batch
