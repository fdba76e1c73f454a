"""A solver that reports a numerical error for every quadratic program."""

import piqp


class FailingSolver(piqp.DenseSolver):
    """PIQP's dense solver with a constant status."""

    def solve(self) -> piqp.Status:
        """Solve, and return the status of a numerical error."""
        super().solve()
        return piqp.PIQP_NUMERICS


piqp.DenseSolver = FailingSolver  # type: ignore[misc]
