"""The work that a plan may take: counted, not timed, so that a request has the same answer on every machine."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from motion.errors import OutOfTime

PROGRAM, CUBE = 60.0, 8e-4
"""Cost of a small program, the rest of its round included, µs on the machine of benchmarks/README.md, and what each
program costs beside that, by the cube of its rows."""

DOUBT = 0.04
"""Cost by rows times unknowns of a program that is solved once more in full, since its reduced form failed, µs."""

LOOK, STOP = 30.0, 1_000.0
"""Cost of one joint of a problem that needs no program, and of the search for final accelerations, µs."""


@dataclass(slots=True)
class Effort:
    """Work left, in µs of that machine."""

    left: float

    def spend(self, joint: int, cost: float) -> None:
        """Account for the `cost` of something done for a joint. Raises OutOfTime where less was left."""
        self.left -= cost
        if self.left < 0:
            raise OutOfTime(joint)

    @contextmanager
    def share(self, most: float) -> Iterator["Effort"]:
        """Set aside a part of what is left, and take back what remains of it."""
        part = Effort(min(most, self.left))
        self.left -= part.left
        try:
            yield part
        finally:
            self.left += max(part.left, 0.0)
