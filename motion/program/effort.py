"""How much work a plan may take: counted, not timed, so that the same request has the same answer on every machine."""

from dataclasses import dataclass

from motion.errors import SolverFailed

PROGRAM = 40.0
"""Cost of a small program, the rest of its round included, µs on the machine of benchmarks/README.md."""

CUBE = 8e-4
"""… and of each cubed row, µs."""


@dataclass(slots=True)
class Effort:
    """Work left, in µs of that machine."""

    left: float

    def spend(self, joint: int, rows: int) -> None:
        """Account for a program of so many rows. Raises SolverFailed with the status "time" where nothing is left."""
        self.left -= PROGRAM + CUBE * rows**3
        if self.left < 0:
            raise SolverFailed(joint, "time")
