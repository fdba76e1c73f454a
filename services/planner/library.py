"""The primitives on disk: one .npz file each, written whole or not at all."""

import logging
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motion.gaussian_archive import is_gaussian
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


@dataclass(frozen=True, slots=True, eq=False)
class Written:
    """A primitive whose file is on disk under a `temporary` name. created: Unix s."""

    name: str
    primitive: Primitive
    created: float
    temporary: Path


class Library:
    """All primitives of a directory, kept in memory.

    `is_new`: the directory was made just now. Files that cannot be read are left alone and reported.
    """

    def __init__(self, directory: Path, log: logging.Logger) -> None:
        self.is_new = not directory.exists()
        directory.mkdir(parents=True, exist_ok=True)
        self._directory = directory
        self._primitives: dict[str, tuple[Primitive, float]] = {}
        self._sweep()
        for path in sorted(directory.glob("*.npz")):
            try:
                self._primitives[path.stem] = self._read(path)
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
        """Check that `name` may be written.

        Raises:
            Refusal: `bad_message` for a malformed name or a full library, `exists` for a name in use.
        """
        if not _NAME.fullmatch(name):
            raise bad_message(
                "name", f"name {name[:SHOWN]!r} must be 1 to 64 letters, digits, - or _, not starting with - or _"
            )
        if name in self._primitives and not replace:
            raise Refusal("exists", f"there is a primitive {name!r}; send replace: true to learn it again", name=name)
        if name not in self._primitives and len(self._primitives) >= MAX_PRIMITIVES:
            sentence = f"the library has {MAX_PRIMITIVES} primitives, as many as it takes; forget one first"
            raise bad_message("name", sentence)

    def write(self, name: str, primitive: Primitive, created: float | None = None) -> Written:
        """Write `primitive` to disk beside the library, for `keep`; in any thread, one call at a time.

        Raises:
            Refusal: `unavailable` where it cannot be written.
        """
        created = time.time() if created is None else created
        with self._writing(f".{name}.tmp") as temporary, temporary.open("wb") as file:
            np.savez(file, created=created, **primitive.to_arrays())  # type: ignore[arg-type]
            file.flush()
            os.fsync(file.fileno())
        return Written(name, primitive, created, temporary)

    def keep(self, written: Written) -> None:
        """Let the library have what `write` has written; it survives a power cut from the next `sync` on.

        Raises:
            Refusal: `unavailable` where it cannot be written.
        """
        with self._writing(f"{written.name}.npz") as path:
            written.temporary.replace(path)
        self._primitives[written.name] = written.primitive, written.created

    def sync(self) -> None:
        """Make new and removed names survive a power cut.

        Raises:
            Refusal: `unavailable` where they may not.
        """
        with self._writing("") as directory:
            descriptor = os.open(directory, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)

    def put(self, name: str, primitive: Primitive, created: float | None = None) -> None:
        """Keep `primitive` as `name`, on disk before this returns.

        Raises:
            Refusal: `unavailable` where it cannot be written.
        """
        self.keep(self.write(name, primitive, created))
        self.sync()

    def remove(self, name: str) -> None:
        """Forget the primitive called `name`.

        Raises:
            Refusal: `unknown_primitive`, or `unavailable` where it cannot be removed.
        """
        self.get(name)
        with self._writing(f"{name}.npz") as path:
            path.unlink(missing_ok=True)
            self.sync()
        del self._primitives[name]

    @contextmanager
    def _writing(self, name: str) -> Iterator[Path]:
        """Give the path of a file; where the disk refuses, raise a Refusal that says so."""
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

    def _read(self, path: Path) -> tuple[Primitive, float]:
        """Return the primitive in a file.

        A file with Gaussian weights, of an earlier version, is rewritten, so that it is converted only once.
        """
        # Given a path, numpy leaves the file open where it is not an archive.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {key: archive[key] for key in archive}
        created = float(arrays.pop("created"))
        primitive = Primitive.from_arrays(arrays)
        if is_gaussian(arrays):
            with suppress(Refusal):  # a library that cannot be written can be read
                self.keep(self.write(path.stem, primitive, created))
        return primitive, created
