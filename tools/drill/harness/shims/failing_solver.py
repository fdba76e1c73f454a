"""Every quadratic program fails numerically."""

import piqp


class FailingSolver(piqp.DenseSolver):
    """Solves, and returns that it could not."""

    def solve(self) -> piqp.Status:
        """Return the status of a numerical breakdown."""
        super().solve()
        return piqp.PIQP_NUMERICS


piqp.DenseSolver = FailingSolver  # type: ignore[misc]
