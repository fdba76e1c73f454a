"""Read a trace into arrays, entity by entity; docs/trace.md lists the entities."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from rerun.chunk import RrdReader

SCALARS = "Scalars:scalars"
TIMELINES = ("sim_time", "tick", "wall")


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One component of one entity: N rows, in the order of writing.

    times: by timeline (N,) int64: ns, ticks of the trace, Unix ns. values: N lists.
    """

    times: dict[str, np.ndarray]
    values: list[list[Any]]

    def array(self) -> np.ndarray:
        """Return the rows that have values as float64: (N,) for single values, (N, K) for K of them."""
        rows = [row for row in self.values if row]
        array = np.array(rows, dtype=np.float64)
        return array[:, 0] if array.ndim == 2 and array.shape[1] == 1 else array

    def ticks(self) -> np.ndarray:
        """Return the ticks of the rows that `array` returns."""
        return np.array([t for t, row in zip(self.times["tick"].tolist(), self.values, strict=True) if row])


class Trace:
    """A recording in memory."""

    def __init__(self, columns: dict[tuple[str, str], Column]) -> None:
        self._columns = columns

    @property
    def entities(self) -> list[str]:
        """All entities that have data on timelines, sorted."""
        return sorted({entity for entity, _ in self._columns})

    def components(self, entity: str) -> list[str]:
        """Return the names of an entity's components, sorted."""
        return sorted(component for known, component in self._columns if known == entity)

    def column(self, entity: str, component: str = SCALARS) -> Column:
        """Return one component of an entity. Raises KeyError, which lists those that there are."""
        try:
            return self._columns[entity, component]
        except KeyError:
            known = self.components(entity) or self.entities
            raise KeyError(f"{entity} {component} is not in the trace; there are {', '.join(known)}") from None

    def scalars(self, entity: str) -> np.ndarray:
        """Return the scalars of an entity, (N,) or (N, K), exactly as written."""
        return self.column(entity).array()

    def texts(self, entity: str) -> list[str]:
        """Return the sentences of an entity of events."""
        return [text for row in self.column(entity, "TextLog:text").values for text in row]


def read_trace(path: Path) -> Trace:
    """Read a .rrd file; static data is left out."""
    pieces: dict[tuple[str, str], list[tuple[dict[str, np.ndarray], list[list[Any]]]]] = {}
    with warnings.catch_warnings():  # a trace without an index, which `volley up` writes, is complete
        warnings.filterwarnings("ignore", "RRD file has no footer")
        reader = RrdReader(path)
    for chunk in reader.stream():
        if chunk.is_static:
            continue
        batch = chunk.to_record_batch()
        times = {name: _integers(batch, name) for name in TIMELINES if name in batch.schema.names}
        for name in batch.schema.names:
            if isinstance(batch.schema.field(name).type, pa.ListType):
                values = [row or [] for row in batch.column(name).to_pylist()]
                pieces.setdefault((chunk.entity_path, name), []).append((times, values))
    return Trace({key: _join(found) for key, found in pieces.items()})


def _integers(batch: pa.RecordBatch, name: str) -> np.ndarray:
    return batch.column(name).cast(pa.int64()).to_numpy()


def _join(pieces: list[tuple[dict[str, np.ndarray], list[list[Any]]]]) -> Column:
    times = {name: np.concatenate([piece[name] for piece, _ in pieces]) for name in pieces[0][0]}
    return Column(times, [row for _, values in pieces for row in values])
