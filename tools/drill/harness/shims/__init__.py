"""Faults inside a process: each module causes one when it is imported before the service."""

from pathlib import Path


def shim(name: str, folder: Path) -> Path:
    """Return a directory that, on PYTHONPATH, makes Python import the shim `name` before anything else."""
    directory = folder / name
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "sitecustomize.py").write_text(f"import tools.drill.harness.shims.{name}\n")
    return directory
