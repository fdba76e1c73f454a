"""Curves on the grid against what is demanded of them (design 1.5)."""

import numpy as np

from motion.problem import BAND, Problem

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
        samples = slice(1) if problem.constant else slice(None)
        self._limit = problem.limit[..., samples] + ROUNDING * problem.half_range[:, :, None]
        self._band = problem.band[..., samples]
        accepted = self._limit - (1 - ACCEPTED) * self._band
        self._lowest, self._highest = -accepted[0], accepted[1]

    def missing(self, joints: np.ndarray, curves: np.ndarray, first: bool) -> list[np.ndarray | None]:
        """For each of the joints (n,) with the curves (n, ≥ 4, M): None if all its samples are accepted; else the rows
        of the peaks of violation with their neighbours and, in a `first` look, of every eighth violated sample."""
        values = curves[:, :4]
        found: list[np.ndarray | None] = [None] * len(joints)
        unsound = np.nonzero(self._outside(joints, values))[0]
        if not unsound.size:
            return found
        worth = (1 - WORTH_ADDING) * self._band[:, joints[unsound]]
        n, rows, sample, peak, _ = self._beyond(joints[unsound], values[unsound], worth)
        eighth = sample % FIRST_STRIDE == 0
        for m, k in enumerate(unsound.tolist()):
            of_joint = n == m
            wanted = with_neighbours(rows[peak & of_joint], PEAK_NEIGHBOURS, values.shape[2])
            found[k] = np.concatenate([wanted, rows[eighth & of_joint]]) if first else wanted
        return found

    def near(self, curves: np.ndarray) -> list[np.ndarray]:
        """For each joint the rows (m,) at which a motion like that of the curves (J, ≥ 4, M) may come to its limits:
        where it runs along one, and its peaks a little below."""
        every, half = np.arange(len(curves)), self.problem.half_range
        n, rows, sample, peak, over = self._beyond(every, curves[:, :4], TOWARDS * half[:, :, None])
        side, quantity = np.divmod(rows // curves.shape[2], 4)
        half = half[n, quantity]
        along = (over > (TOWARDS - ALONG) * half) & (sample % ALONG_STRIDE == 0)
        # Beside a boundary value on its limit there is nothing to gain.
        wide = self.problem.band[side, n, quantity, sample] > 0.1 * BAND * half
        chosen = (peak | along) & wide
        return [rows[chosen & (n == joint)] for joint in every]

    def _outside(self, joints: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Whether some of the joints' `values` (n, 4, M) are not accepted: (n,)."""
        here = self._part(joints)
        lowest, highest = self._lowest[here], self._highest[here]
        if self.problem.constant:
            outside = (values.max(axis=2) > highest[..., 0]) | (values.min(axis=2) < lowest[..., 0])
        else:
            outside = values > highest
            outside |= values < lowest
        return outside.reshape(len(joints), -1).any(axis=1)

    def _part(self, joints: np.ndarray) -> np.ndarray | slice:
        """An index of the joints (n,), which are in order; all of them need no copy."""
        return slice(None) if len(joints) == len(self._highest) else joints

    def _beyond(self, joints: np.ndarray, values: np.ndarray, depth: np.ndarray) -> tuple[np.ndarray, ...]:
        """Where the joints' `values` (n, 4, M) pass what lies by `depth` (broadcast to (2, n, 4, M)) inside the limits:
        which of the n, the rows, their samples, which are peaks, and by how much they pass it."""
        here = self._part(joints)
        bound = self._limit[:, here] - depth
        over = np.empty((2, *values.shape))
        np.subtract(-bound[0], values, out=over[0])
        np.subtract(values, bound[1], out=over[1])
        over = over.ravel()
        place = (over > 0).nonzero()[0]
        rest, sample = np.divmod(place, values.shape[2])
        rest, quantity = np.divmod(rest, 4)
        side, n = np.divmod(rest, len(joints))
        above = over[place]
        rises = (above >= over.take(place - 1)) | (sample == 0)
        falls = (above >= over.take(place + 1, mode="clip")) | (sample == values.shape[2] - 1)
        return n, (side * 4 + quantity) * values.shape[2] + sample, sample, rises & falls, above


def with_neighbours(rows: np.ndarray, offsets: np.ndarray, count: int) -> np.ndarray:
    """The rows, and of the same side and quantity those at the offsets in samples."""
    sample = rows % count
    near = (sample[:, None] + offsets).clip(0, count - 1)
    return ((rows - sample)[:, None] + near).ravel()
