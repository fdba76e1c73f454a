"""Faults and counters inside a process: each module is imported there before the service."""

from collections.abc import Mapping
from pathlib import Path


def shim(name: str, folder: Path) -> Path:
    """Return a directory that, on PYTHONPATH, makes Python import the shim `name` before anything else."""
    directory = folder / name
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "sitecustomize.py").write_text(f"import tools.drill.harness.shims.{name}\n")
    return directory


def counts(directory: Path, kind: str, pids: Mapping[str, int]) -> dict[str, int]:
    """Return the number that each exited process wrote to PID.`kind`; processes without the shim are omitted."""
    files = {name: directory / f"{pid}.{kind}" for name, pid in pids.items()}
    return {name: int(file.read_text()) for name, file in files.items() if file.exists()}
