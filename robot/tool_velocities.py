"""Joint velocities for a velocity of the tool."""

from collections.abc import Sequence

import numpy as np

MISSED = 1e-8
"""Relative tolerance of the velocity."""
SINGULAR = 1e-6
"""Singular values below this part of the largest count as zero."""


def joint_velocities(
    rows: np.ndarray, wanted: np.ndarray, limits: np.ndarray, names: Sequence[str]
) -> np.ndarray | str:
    """Return the joint velocities (J,) with rows (m, J) · velocities = wanted (m,), or a sentence why none exist.

    They have the least norm in units of the limits (J,). A joint that would exceed its limit is fixed at it, and a
    redundant arm compensates with its other joints (saturation in the null space, Flacco et al. 2012).
    """
    scale = np.where(np.isfinite(limits), limits, 1.0)
    free, found = np.ones(len(limits), dtype=bool), np.zeros(len(limits))
    first: np.ndarray | None = None
    while free.any():
        rest = wanted - rows[:, ~free] @ found[~free]
        found[free] = scale[free] * (np.linalg.pinv(rows[:, free] * scale[free], rcond=SINGULAR) @ rest)
        first = found.copy() if first is None else first
        if _missed(rows, found, wanted):
            break
        worst = int(np.argmax(np.abs(found) / limits))
        if abs(found[worst]) <= limits[worst]:
            return found
        free[worst], found[worst] = False, np.copysign(limits[worst], found[worst])
    assert first is not None
    if _missed(rows, first, wanted):
        return "the tool cannot move in this direction from there: the arm is stretched out or has too few joints"
    worst = int(np.argmax(np.abs(first) / limits))
    share = np.floor(100 * limits[worst] / abs(first[worst])) / 100
    cure = f"{share:.2f} of that velocity works" if share else "the arm is nearly stretched out: give it another place"
    return (
        f"the tool's velocity needs {abs(first[worst]):.3g} rad/s of {names[worst]}, whose limit is "
        f"{limits[worst]:.3g} rad/s; {cure}"
    )


def _missed(rows: np.ndarray, found: np.ndarray, wanted: np.ndarray) -> bool:
    return bool(np.linalg.norm(rows @ found - wanted) > MISSED * max(1.0, float(np.linalg.norm(wanted))))
