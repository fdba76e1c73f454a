"""The work that a plan may take: counted, not timed, so that a request has the same answer on every machine."""

from dataclasses import dataclass

from motion.errors import OutOfTime

PROGRAM = 60.0
"""Cost of a small program, the rest of its round included, µs on the machine of benchmarks/README.md."""

CUBE = 8e-4
"""Cost of a program beside that, by the cube of its rows, µs."""

LOOK = 30.0
"""Cost of one joint of a problem that needs no program, µs."""

STOP = 1_000.0
"""Cost of the search for final accelerations, µs."""

DOUBT = 0.04
"""Cost by rows times unknowns of a program that is solved once more in full, since its reduced form failed, µs."""


@dataclass(slots=True)
class Effort:
    """Work left, in µs of that machine."""

    left: float

    def spend(self, joint: int, rows: int) -> None:
        """Account for a program of so many rows. Raises OutOfTime where nothing is left."""
        self._spend(joint, PROGRAM + CUBE * rows**3)

    def spend_on_look(self, joint: int) -> None:
        """Account for setting a problem up and looking at one joint of it. Raises OutOfTime where nothing is left."""
        self._spend(joint, LOOK)

    def spend_on_stop(self, joint: int) -> None:
        """Account for the search for final accelerations that leave room for a stop. Raises OutOfTime."""
        self._spend(joint, STOP)

    def spend_on_doubt(self, joint: int, rows: int, unknowns: int) -> None:
        """Account for a program that is solved in doubt. Raises OutOfTime where nothing is left."""
        self._spend(joint, DOUBT * rows * unknowns)

    def share(self, most: float) -> "Effort":
        """Set aside a part of what is left; `give_back` what remains of it."""
        part = Effort(min(most, self.left))
        self.left -= part.left
        return part

    def give_back(self, part: "Effort") -> None:
        """Take back what is left of a share."""
        self.left += max(part.left, 0.0)

    def _spend(self, joint: int, cost: float) -> None:
        self.left -= cost
        if self.left < 0:
            raise OutOfTime(joint)
