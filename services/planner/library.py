"""The library of primitives on disk: one .npz file each, written atomically."""

import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motion.listing import listed
from motion.primitive import Primitive
from protocol import messages as m
from protocol.codec import bad_message
from protocol.errors import Refusal
from protocol.topics import PRIMITIVE_NAME
from services.planner.archive import from_arrays, is_gaussian, to_arrays

SHOWN = 80
"""Characters of a refused name that are shown."""

MAX_PRIMITIVES = 256
"""Largest number of primitives: all of them stay in memory."""

BEGUN = ".begun"
"""File that distinguishes a library whose primitives were all removed from a new one."""

LISTED = 10
"""Number of names listed in the refusal of an unknown one."""


@dataclass(frozen=True, slots=True)
class Arm:
    """The arm on which a primitive was learned; unknown if it has no joint names."""

    robot: str = ""
    joint_names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """A primitive of a library. created: Unix s."""

    primitive: Primitive
    created: float
    arm: Arm


@dataclass(frozen=True, slots=True, eq=False)
class Written:
    """A primitive on disk under a `temporary` name, to be renamed to `name`."""

    name: str
    kept: Kept
    temporary: Path


class Library:
    """All primitives of an arm's directory, kept in memory.

    `is_new`: whether the directory has no primitives and `begin` was never called for it. Unreadable files are logged
    and not changed. Primitives of another arm are listed, but refused when played. All methods that write raise
    Refusal, `unavailable`, if writing fails; then nothing has changed.
    """

    def __init__(self, directory: Path, arm: Arm, log: logging.Logger) -> None:
        self._arm = arm
        directory.mkdir(parents=True, exist_ok=True)
        self._directory = directory
        self.is_new = not any(path.suffix == ".npz" or path.name == BEGUN for path in directory.iterdir())
        self._primitives: dict[str, Kept] = {}
        self._sweep()
        for path in sorted(directory.glob("*.npz")):
            try:
                self._primitives[path.stem] = self._read(path)
            except Exception as error:  # zipfile and numpy raise many kinds of errors for a damaged archive
                log.warning("%s is not a primitive and is left alone: %s", path, error)

    def __iter__(self) -> Iterator[m.PrimitiveEntry]:
        for name, kept in sorted(self._primitives.items()):
            yield m.PrimitiveEntry(
                name=name,
                joint_count=kept.primitive.joint_count,
                duration=kept.primitive.duration,
                samples=kept.primitive.samples,
                created=kept.created,
                robot=kept.arm.robot,
                joint_names=list(kept.arm.joint_names),
            )

    def begin(self) -> None:
        """Note that the shipped primitives were learned: if they are removed, they are not learned again."""
        (self._directory / BEGUN).touch()

    def get(self, name: str) -> Primitive:
        """Return the primitive called `name`.

        Raises:
            Refusal: `unknown_primitive`, with a list of the known ones.
        """
        try:
            return self._primitives[name].primitive
        except KeyError:
            there = listed(sorted(self._primitives), LISTED) or "none yet; send one to `learn`"
            sentence = f"there is no primitive {name[:SHOWN]!r}; there is {there}"
            raise Refusal("unknown_primitive", sentence, name=name[:SHOWN]) from None

    def playable(self, name: str) -> Primitive:
        """Return the primitive called `name`, checked to be playable by this arm.

        Raises:
            Refusal: `unknown_primitive`, or `invalid_goal` for a primitive of other joints.
        """
        primitive, theirs = self.get(name), self._primitives[name].arm
        if theirs.joint_names and theirs.joint_names != self._arm.joint_names:
            sentence = (
                f"primitive {name!r} was learned on {theirs.robot}, whose joints are {listed(theirs.joint_names)}; "
                f"those of this arm are {listed(self._arm.joint_names)}: learn its recording for this arm"
            )
            raise Refusal("invalid_goal", sentence, field="primitive")
        return primitive

    def check_name(self, name: str, replace: bool) -> None:
        """Check that a primitive may be written as `name`.

        Raises:
            Refusal: `bad_message` for a malformed name or a full library, `exists` for a name in use.
        """
        if not PRIMITIVE_NAME.fullmatch(name):
            sentence = f"name {name[:SHOWN]!r} must be 1 to 64 letters, digits, - or _, not starting with - or _"
            raise bad_message("name", sentence)
        if name in self._primitives and not replace:
            sentence = f"there is a primitive {name!r}; take another name, or send replace: true (--replace)"
            raise Refusal("exists", sentence, name=name)
        if name not in self._primitives and len(self._primitives) >= MAX_PRIMITIVES:
            sentence = f"the library has {MAX_PRIMITIVES} primitives, as many as it takes; forget one first"
            raise bad_message("name", sentence)

    def write(self, name: str, primitive: Primitive) -> Written:
        """Write `primitive`, learned on this arm now, to a temporary file for `keep`.

        Called in any thread, one call at a time.
        """
        return self._write(name, Kept(primitive, time.time(), self._arm))

    def keep(self, written: Written) -> None:
        """Add a primitive written by `write` to the library; it survives a power cut after the next `sync`."""
        with self._writing(f"{written.name}.npz") as path:
            written.temporary.replace(path)
        self._primitives[written.name] = written.kept

    def sync(self) -> None:
        """Make new and removed names survive a power cut."""
        with self._writing("") as directory:
            descriptor = os.open(directory, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)

    def put(self, name: str, primitive: Primitive) -> None:
        """Add `primitive` as `name`; it is on disk when this returns."""
        self.keep(self.write(name, primitive))
        self.sync()

    def take_over(self, path: Path) -> None:
        """Copy a primitive of this arm from another library; it is on disk when this returns.

        Raises:
            Exception: the file is not a primitive; zipfile and numpy raise many kinds of errors.
        """
        self.keep(self._write(path.stem, replace(self._read(path), arm=self._arm)))
        self.sync()

    def remove(self, name: str) -> None:
        """Remove the primitive called `name`.

        Raises:
            Refusal: `unknown_primitive`.
        """
        self.get(name)
        with self._writing(f"{name}.npz") as path:
            path.unlink(missing_ok=True)
            self.sync()
        del self._primitives[name]

    @contextmanager
    def _writing(self, name: str) -> Iterator[Path]:
        """Yield the path of a file to write."""
        try:
            yield self._directory / name
        except OSError as error:
            self._sweep()
            sentence = f"the library {self._directory} cannot be written: {error.strerror or error}; nothing changed"
            raise Refusal("unavailable", sentence, service="planner") from None

    def _sweep(self) -> None:
        """Remove the files of interrupted writes."""
        for leftover in self._directory.glob(".*.tmp"):
            leftover.unlink(missing_ok=True)  # the thread that writes may have removed it

    def _write(self, name: str, kept: Kept) -> Written:
        arm = {"robot": kept.arm.robot, "joint_names": np.array(kept.arm.joint_names, dtype=np.str_)}
        with self._writing(f".{name}.tmp") as temporary, temporary.open("wb") as file:
            np.savez(file, created=kept.created, **arm, **to_arrays(kept.primitive))  # type: ignore[arg-type]
            file.flush()
            os.fsync(file.fileno())
        return Written(name, kept, temporary)

    def _read(self, path: Path) -> Kept:
        """Return the primitive in a file; a file of an earlier version does not name its arm."""
        # Given a path, numpy does not close a file that is not an archive.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {key: archive[key] for key in archive}
        arm = Arm(str(arrays.get("robot", "")), tuple(arrays.get("joint_names", np.array([], dtype=np.str_)).tolist()))
        kept = Kept(from_arrays(arrays), float(arrays["created"]), arm)
        if is_gaussian(arrays) and path.parent == self._directory:  # so that it is converted only once
            with suppress(Refusal):  # a library that cannot be written can be read
                self.keep(self._write(path.stem, kept))
        return kept
