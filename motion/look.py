"""Curves on the grid against what is demanded of them (design 1.5)."""

import numpy as np

from motion.problem import SIGNS, Problem

ACCEPTED = 0.9
"""Part of the band that a sample may use up."""

WORTH_ADDING = 0.2
"""Part of the band beyond which a peak becomes a row once some sample is not accepted."""

ROUNDING = 2e-7
"""Of half a limit's range: samples beside a boundary value on its limit are not looked at closer."""

PEAK_NEIGHBOURS = np.array([-3, 0, 3])
FIRST_STRIDE = 8


class Look:
    """Finds the samples at which rows are missing. Rows are numbered (side·4 + quantity)·M + sample."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        # Limits that are the same at every sample are one number each, stretched over the samples.
        stretched = not (problem.limit.flags.writeable or problem.band.flags.writeable)
        samples = slice(1) if stretched else slice(None)
        inside = problem.limit[..., samples] - (1 - WORTH_ADDING) * problem.band[..., samples]
        inside += ROUNDING * problem.half_range[:, :, None]
        self.lowest, self.highest = -inside[0], inside[1]

    def missing(self, joints: np.ndarray, curves: np.ndarray, first: bool) -> list[np.ndarray | None]:
        """For each of the joints (n,) with the curves (n, ≥ 4, M): None if all its samples are accepted; else the rows
        of the peaks of violation with their neighbours and, in a `first` look, of every eighth violated sample."""
        values, count = curves[:, :4], curves.shape[2]
        here = slice(None) if len(joints) == len(self.highest) else joints
        outside = values > self.highest[here]
        outside |= values < self.lowest[here]
        n, quantity, sample = np.nonzero(outside)
        found: list[np.ndarray | None] = [None] * len(joints)
        if not n.size:
            return found
        place = slice(None), joints[n], quantity, sample
        over = SIGNS[:, None] * values[n, quantity, sample] - self.problem.limit[place] + self.problem.band[place]
        side = (over[1] > over[0]).astype(int)
        over, band = over.max(axis=0), self.problem.band[side, *place[1:]]
        unsound = n[over > ACCEPTED * band + ROUNDING * self.problem.half_range[place[1:3]]]
        if unsound.size:
            rows = (side * 4 + quantity) * count + sample
            peak = _peaks(rows, n, sample, over)
            for k in set(unsound.tolist()):
                of_joint = n == k
                found[k] = with_neighbours(rows[peak & of_joint], PEAK_NEIGHBOURS, count)
                if first:
                    found[k] = np.concatenate([found[k], rows[of_joint & (sample % FIRST_STRIDE == 0)]])
        return found


def with_neighbours(rows: np.ndarray, offsets: np.ndarray, count: int) -> np.ndarray:
    """The rows, and of the same side and quantity those at the offsets in samples."""
    sample = rows % count
    near = np.clip(sample[:, None] + offsets, 0, count - 1)
    return ((rows - sample)[:, None] + near).ravel()


def _peaks(rows: np.ndarray, n: np.ndarray, sample: np.ndarray, over: np.ndarray) -> np.ndarray:
    """Which of the rows are local maxima of `over` in their stretch of neighbouring samples of one curve."""
    apart = (rows[1:] - rows[:-1] != 1) | (n[1:] != n[:-1]) | (sample[1:] == 0)
    border = np.ones(1, dtype=bool)
    rises = np.concatenate([border, apart | (over[1:] >= over[:-1])])
    falls = np.concatenate([apart | (over[:-1] >= over[1:]), border])
    return rises & falls
