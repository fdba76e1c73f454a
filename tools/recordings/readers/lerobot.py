"""LeRobot data sets of the layouts v2 and v3: a directory with meta/info.json and parquet files below data/."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tools.recordings.recording import Episode, Recording, Unreadable, check_size

STATE = "observation.state"
COLUMNS = [STATE, "timestamp", "episode_index"]
SYNTHETIC = 1e-2
"""Largest distance, in frames, of stamps from frame/fps that the writer has computed, rounded to float32."""


def episodes(path: Path, rate: float | None) -> list[Episode]:
    """Return the episodes, named by their numbers."""
    info = _info(path)
    hertz = rate or _fps(path, info)
    return [Episode(str(number), length, (length - 1) / hertz) for number, length, _ in _episodes(path, info)]


def read(path: Path, episode: str, rate: float | None) -> Recording:
    """Return the states of an episode."""
    info = _info(path)
    number = int(episode)
    length, file = next((length, file) for known, length, file in _episodes(path, info) if known == number)
    check_size(path, f"episode {episode}", length)
    if not file.is_file():
        raise Unreadable(f"{path} lacks {file.relative_to(path)}, which has episode {episode}; download it whole")
    table = pq.read_table(file, columns=COLUMNS, filters=[("episode_index", "=", number)])
    values = _matrix(table.column(STATE))
    hertz = rate or _fps(path, info)
    times = np.arange(len(values)) / hertz
    stamps = table.column("timestamp").to_numpy().astype(float)
    stamped = rate is None and bool(np.abs(stamps - stamps[0] - times).max() * hertz > SYNTHETIC)
    chosen, columns = stamps - stamps[0] if stamped else times, _columns(info, values.shape[1])
    return Recording(chosen, columns, values, None, path, episode, stamped, normalised=True)


def _fps(path: Path, info: dict[str, Any]) -> float:
    fps = info.get("fps")
    if not isinstance(fps, int | float) or not 0 < fps < np.inf:
        raise Unreadable(f"{path}: fps in meta/info.json is {fps!r}; give --rate, in frames a second")
    return float(fps)


def _info(path: Path) -> dict[str, Any]:
    """Return meta/info.json. Raises Unreadable for an unknown version, or for data without joints."""
    info = json.loads((path / "meta" / "info.json").read_text(encoding="utf-8"))
    version = str(info.get("codebase_version", ""))
    if not version.startswith(("v2", "v3")):
        raise Unreadable(f"{path} is a LeRobot data set of version {version or 'unknown'}; v2 and v3 are read")
    if STATE not in info.get("features", {}):
        raise Unreadable(f"{path} has no feature {STATE}; it has {', '.join(info.get('features', {}))}")
    return info


def _episodes(path: Path, info: dict[str, Any]) -> list[tuple[int, int, Path]]:
    """Return number, length and file of every episode."""
    if str(info["codebase_version"]).startswith("v2"):
        lines = (path / "meta" / "episodes.jsonl").read_text(encoding="utf-8").splitlines()
        listed = [json.loads(line) for line in lines if line.strip()]
        size = int(info.get("chunks_size", 1000))
        return [
            (number, int(one["length"]), path / f"data/chunk-{number // size:03d}/episode_{number:06d}.parquet")
            for one in listed
            for number in [int(one["episode_index"])]
        ]
    wanted = ["episode_index", "length", "data/chunk_index", "data/file_index"]
    files = sorted((path / "meta" / "episodes").glob("chunk-*/file-*.parquet"))
    rows = [row for file in files for row in pq.read_table(file, columns=wanted).to_pylist()]
    return [
        (
            int(row["episode_index"]),
            int(row["length"]),
            path / f"data/chunk-{row['data/chunk_index']:03d}/file-{row['data/file_index']:03d}.parquet",
        )
        for row in sorted(rows, key=lambda row: row["episode_index"])
    ]


def _matrix(column: pa.ChunkedArray) -> np.ndarray:
    rows = column.combine_chunks()
    return np.asarray(rows.flatten(), dtype=float).reshape(len(rows), -1)


def _columns(info: dict[str, Any], count: int) -> tuple[str, ...]:
    """Return the names of the state's numbers: a list, a list under a key such as `motors`, or a map to indices."""
    names = info["features"][STATE].get("names")
    if isinstance(names, dict) and all(isinstance(index, int) for index in names.values()):
        names = sorted(names, key=names.__getitem__)
    elif isinstance(names, dict):
        names = next(iter(names.values()), None)
    return tuple(map(str, names)) if isinstance(names, list) and len(names) == count else ()
