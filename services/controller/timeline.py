"""The reference trajectory: spliced segments, one sample a tick."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motion.braking import first_stop, stop
from motion.limits import Limits
from motion.trajectory import Samples
from protocol.messages import State

WINDOW = 64
"""Ticks that are searched first for a stop: it is nearly always near, and the loop has only one tick's time."""


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Samples (count, J), one a tick, from tick `start`; the reference stays at the last one."""

    start: int
    samples: Samples

    @property
    def end(self) -> int:
        """Tick of the last sample."""
        return self.start + len(self.samples.positions) - 1


class Timeline:
    """Segments in order of time; each replaces earlier ones from its start on."""

    def __init__(self, positions: np.ndarray, limits: Limits, length: float) -> None:
        """Stay at `positions` (J,) from tick 0 on; stops keep `limits`. `length`: of a tick, s."""
        self._limits = limits
        self._length = length
        self.hold(positions, 0)

    def hold(self, positions: np.ndarray, tick: int) -> None:
        """Drop all segments and stay at `positions` (J,) from `tick` on."""
        still = np.zeros((1, len(positions)))
        here = np.array(positions, dtype=float)[None, :]
        self._segments = [Segment(tick, Samples(here, still, still))]

    def give_way(self, state: State, accelerations: Sequence[float] | None = None, delay: int = 0) -> None:
        """Drop all segments and, from the measured `state`, keep `accelerations` for `delay` ticks and then stop.

        accelerations: (J,), rad/s², by default 0. The stop keeps the limits of velocity, acceleration and jerk.
        Position limits are not guaranteed, because the start is given.
        """
        limits, times = self._limits, np.arange(delay + 1)[:, None] * self._length
        velocities = np.clip(state.velocities, -limits.velocities, limits.velocities)
        kept = np.clip(accelerations or 0 * velocities, -limits.accelerations, limits.accelerations)
        positions = np.array(state.positions) + times * (velocities + times / 2 * kept)
        self._segments = [Segment(state.tick, Samples(positions, velocities + times * kept, kept + 0 * times))]
        self._splice_stop(state.tick + delay)

    def splice(self, segment: Segment) -> None:
        """Let `segment` replace everything from its start on."""
        self._segments = [kept for kept in self._segments if kept.start < segment.start] + [segment]

    def at(self, tick: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return position, velocity and acceleration (J,) at `tick`, as views; do not modify them."""
        segment = self._segments[0]
        for later in self._segments[1:]:
            if later.start > tick:
                break
            segment = later
        index = min(max(tick, segment.start), segment.end) - segment.start
        samples = segment.samples
        return samples.positions[index], samples.velocities[index], samples.accelerations[index]

    def stop(self, tick: int) -> tuple[int, int]:
        """Splice in the earliest jerk-limited stop, from `tick` on, that stays inside the limits.

        Returns the ticks at which the reference leaves the plan and from which it rests. If no stop ends earlier, both
        are the plan's end. An arm at rest at `tick` stays there, even outside the limits.
        """
        _, velocities, accelerations = self.at(tick)
        if not (velocities.any() or accelerations.any()):
            return self._splice_stop(tick)
        ahead, size = tick, WINDOW
        while ahead < self.end:
            coming = self.coming(ahead, size)
            index = first_stop(coming, self._limits)
            if index is not None:
                return self._splice_stop(ahead + index)
            ahead, size = ahead + size, 4 * size
        rests = max(tick, self.end)
        return rests, rests

    def _splice_stop(self, tick: int) -> tuple[int, int]:
        segment = self._stop_from(tick, *self.at(tick))
        self.splice(segment)
        return segment.start, segment.end

    def coming(self, tick: int, count: int) -> Samples:
        """Return the samples of `count` ticks from `tick` on."""
        ticks = np.arange(tick, tick + count)
        owners = np.searchsorted([segment.start for segment in self._segments], ticks, side="right") - 1
        parts = []
        for index, segment in enumerate(self._segments):
            mine = ticks[np.maximum(owners, 0) == index]
            rows = np.clip(mine, segment.start, segment.end) - segment.start
            samples = segment.samples
            parts.append((samples.positions[rows], samples.velocities[rows], samples.accelerations[rows]))
        return Samples(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))

    def forget_before(self, tick: int) -> None:
        """Drop the segments that have ended at `tick`."""
        while len(self._segments) > 1 and self._segments[1].start <= tick:
            del self._segments[0]

    @property
    def end(self) -> int:
        """Tick from which the reference is at rest for good."""
        return self._segments[-1].end

    def _stop_from(
        self, tick: int, positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray
    ) -> Segment:
        """Return the stop that starts at `tick` from a state (J,)."""
        halt = stop(positions, velocities, accelerations, self._limits)
        count = math.ceil(halt.duration / self._length - 1e-9) + 1
        return Segment(tick, halt.sample(np.arange(count) * self._length))
