"""The primitives on disk: one .npz file each, written whole or not at all."""

import logging
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from motion.primitive import Primitive
from protocol import messages as m
from protocol.codec import bad_message
from protocol.errors import Refusal

SHOWN = 80
"""Characters of a name that are shown of one that cannot be."""

MAX_PRIMITIVES = 256
"""Of a library: each stays in memory."""

LISTED = 10
"""Names in the sentence that refuses an unknown one."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")


class Library:
    """All primitives of a directory, kept in memory.

    `is_new` tells whether the directory was made just now. Files that cannot be read are left alone and reported.
    """

    def __init__(self, directory: Path, log: logging.Logger) -> None:
        self.is_new = not directory.exists()
        directory.mkdir(parents=True, exist_ok=True)
        self._directory = directory
        self._primitives: dict[str, tuple[Primitive, float]] = {}
        self._sweep()
        for path in sorted(directory.glob("*.npz")):
            try:
                self._primitives[path.stem] = _read(path)
            except Exception as error:  # a damaged archive makes zipfile and numpy raise whatever they like
                log.warning("%s is not a primitive and is left alone: %s", path, error)

    def __iter__(self) -> Iterator[m.PrimitiveEntry]:
        for name, (primitive, created) in sorted(self._primitives.items()):
            yield m.PrimitiveEntry(
                name=name,
                joint_count=primitive.joint_count,
                duration=primitive.duration,
                samples=primitive.samples,
                created=created,
            )

    def get(self, name: str) -> Primitive:
        """Return the primitive called `name`.

        Raises:
            Refusal: `unknown_primitive`, listing what there is.
        """
        try:
            return self._primitives[name][0]
        except KeyError:
            first, rest = sorted(self._primitives)[:LISTED], len(self._primitives) - LISTED
            there = ", ".join(first) + (f" and {rest} more" if rest > 0 else "") or "none yet; send one to `learn`"
            asked = name[:SHOWN]
            raise Refusal(
                "unknown_primitive", f"there is no primitive {asked!r}; there is {there}", name=asked
            ) from None

    def check_name(self, name: str, replace: bool) -> None:
        """Raise a Refusal unless `name` may be written: `bad_message` for a bad name or a full library,
        `exists` for a taken name."""
        if not _NAME.fullmatch(name):
            raise bad_message(
                "name", f"name {name[:SHOWN]!r} must be 1 to 64 letters, digits, - or _, not starting with - or _"
            )
        if name in self._primitives and not replace:
            raise Refusal("exists", f"there is a primitive {name!r}; send replace: true to learn it anew", name=name)
        if name not in self._primitives and len(self._primitives) >= MAX_PRIMITIVES:
            sentence = f"the library has {MAX_PRIMITIVES} primitives, as many as it takes; forget one first"
            raise bad_message("name", sentence)

    def put(self, name: str, primitive: Primitive) -> None:
        """Keep `primitive` as `name`, on disk before this returns.

        Raises:
            Refusal: `unavailable` where it cannot be written.
        """
        created = time.time()
        with self._writing(f".{name}.tmp") as temporary:
            with temporary.open("wb") as file:
                np.savez(file, created=created, **primitive.to_arrays())  # type: ignore[arg-type]
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(self._directory / f"{name}.npz")
            self._sync_directory()
        self._primitives[name] = primitive, created

    def remove(self, name: str) -> None:
        """Forget the primitive called `name`.

        Raises:
            Refusal: `unknown_primitive`, or `unavailable` where it cannot be removed.
        """
        self.get(name)
        with self._writing(f"{name}.npz") as path:
            path.unlink(missing_ok=True)
            self._sync_directory()
        del self._primitives[name]

    @contextmanager
    def _writing(self, name: str) -> Iterator[Path]:
        """Give the path of a file; where the disk refuses, say so to whoever asked."""
        try:
            yield self._directory / name
        except OSError as error:
            self._sweep()
            sentence = f"the library {self._directory} cannot be written: {error.strerror or error}; nothing changed"
            raise Refusal("unavailable", sentence, service="planner") from None

    def _sweep(self) -> None:
        """Remove what a write that was cut off has left."""
        for leftover in self._directory.glob(".*.tmp"):
            leftover.unlink()

    def _sync_directory(self) -> None:
        """Make a new or removed name survive a power cut."""
        descriptor = os.open(self._directory, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _read(path: Path) -> tuple[Primitive, float]:
    # Given a path, numpy leaves the file open where it is not an archive.
    with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        return Primitive.from_arrays({key: arrays[key] for key in arrays if key != "created"}), float(arrays["created"])
