"""The work of a plan, counted instead of timed, so that a request gets the same reply on every machine."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from motion.errors import OutOfTime

PROGRAM, CUBE = 60.0, 8e-4
"""Cost of a small program with the rest of its round, µs on the machine of benchmarks/README.md, and the additional
cost of a program, by the cube of its rows."""

FULL_SOLVE = 0.04
"""Cost, by rows times unknowns, µs, of a program that is solved again in full because its dual form failed."""

CHECK, STOP = 30.0, 1_000.0
"""Cost, µs, of one joint of a problem without a program, and of the search for final accelerations."""


@dataclass(slots=True)
class Effort:
    """Remaining work, µs on the machine of benchmarks/README.md."""

    left: float

    def spend(self, joint: int, cost: float) -> None:
        """Subtract the `cost` of work for a joint. Raises OutOfTime if less was left."""
        self.left -= cost
        if self.left < 0:
            raise OutOfTime(joint)

    @contextmanager
    def share(self, most: float) -> Iterator["Effort"]:
        """Reserve at most `most` of the remaining effort; return the unused part of it afterwards."""
        part = Effort(min(most, self.left))
        self.left -= part.left
        try:
            yield part
        finally:
            self.left += max(part.left, 0.0)
