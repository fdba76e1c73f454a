"""Curves on the grid against what is demanded of them (design 1.5)."""

import numpy as np

from motion.problem import BAND, SIGNS, Problem

ACCEPTED = 0.9
"""Part of the band that a sample may use up."""

WORTH_ADDING = 0.2
"""Part of the band beyond which a peak becomes a row once some sample is not accepted."""

ROUNDING = 2e-7
"""Of half a limit's range: samples beside a boundary value on its limit are not looked at closer."""

PEAK_NEIGHBOURS = np.array([-3, 0, 3])
FIRST_STRIDE = 8

ALONG, ALONG_STRIDE = 0.002, 6
"""An earlier motion runs along a limit where it is nearer than this part of half its range: every sixth sample there is
a row to begin with."""

TOWARDS = 0.02
"""So are its peaks nearer than this: the next motion may come up to the limit there."""


class Look:
    """Finds the samples at which rows are missing. Rows are numbered (side·4 + quantity)·M + sample."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        # Limits that are the same at every sample are one number each, stretched over the samples.
        stretched = not (problem.limit.flags.writeable or problem.band.flags.writeable)
        samples = slice(1) if stretched else slice(None)
        self._limit = problem.limit[..., samples] + ROUNDING * problem.half_range[:, :, None]
        self._band = problem.band[..., samples]
        accepted = self._limit - (1 - ACCEPTED) * self._band
        self._lowest, self._highest = -accepted[0], accepted[1]

    def missing(self, joints: np.ndarray, curves: np.ndarray, first: bool) -> list[np.ndarray | None]:
        """For each of the joints (n,) with the curves (n, ≥ 4, M): None if all its samples are accepted; else the rows
        of the peaks of violation with their neighbours and, in a `first` look, of every eighth violated sample."""
        values = curves[:, :4]
        here = slice(None) if len(joints) == len(self._highest) else joints
        outside = values > self._highest[here]
        outside |= values < self._lowest[here]
        found: list[np.ndarray | None] = [None] * len(joints)
        for k in outside.any(axis=(1, 2)).nonzero()[0].tolist():
            joint = int(joints[k])
            rows, sample, peak, _ = self._beyond(joint, values[k], (1 - WORTH_ADDING) * self._band[:, joint])
            found[k] = with_neighbours(rows[peak], PEAK_NEIGHBOURS, values.shape[2])
            if first:
                found[k] = np.concatenate([found[k], rows[sample % FIRST_STRIDE == 0]])
        return found

    def near(self, joint: int, curves: np.ndarray) -> np.ndarray:
        """The rows (m,) at which a motion like that of the curves (≥ 4, M) may come to a limit of the joint: where it
        runs along one, and its peaks a little below."""
        half, count = self.problem.half_range[joint], curves.shape[1]
        rows, sample, peak, over = self._beyond(joint, curves[:4], TOWARDS * half[:, None])
        quantity = rows // count % 4
        along = (over > (TOWARDS - ALONG) * half[quantity]) & (sample % ALONG_STRIDE == 0)
        # Beside a boundary value on its limit there is nothing to gain.
        wide = self.problem.band[rows // (4 * count), joint, quantity, sample] > 0.1 * BAND * half[quantity]
        return rows[(peak | along) & wide]

    def _beyond(self, joint: int, values: np.ndarray, depth: np.ndarray) -> tuple[np.ndarray, ...]:
        """Where one joint's `values` (4, M) pass what lies by `depth` (broadcast to (2, 4, M)) inside the limits: the
        rows, their samples, which are peaks, and by how much they pass it."""
        over = (SIGNS[:, None, None] * values - self._limit[:, joint] + depth).ravel()
        rows = (over > 0).nonzero()[0]
        sample = rows % values.shape[1]
        here = over[rows]
        rises = (here >= over.take(rows - 1)) | (sample == 0)
        falls = (here >= over.take(rows + 1, mode="clip")) | (sample == values.shape[1] - 1)
        return rows, sample, rises & falls, here


def with_neighbours(rows: np.ndarray, offsets: np.ndarray, count: int) -> np.ndarray:
    """The rows, and of the same side and quantity those at the offsets in samples."""
    sample = rows % count
    near = (sample[:, None] + offsets).clip(0, count - 1)
    return ((rows - sample)[:, None] + near).ravel()
