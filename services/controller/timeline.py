"""Where the arm shall be at every tick to come."""

from dataclasses import dataclass

import numpy as np

from motion.samples import Samples


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Samples (count, J), one a tick, the first at tick `start`; after the last the arm stays there."""

    start: int
    samples: Samples

    @property
    def end(self) -> int:
        """Tick of the last sample."""
        return self.start + len(self.samples.positions) - 1


class Timeline:
    """Segments in time, each replacing all that came before from its start on."""

    def __init__(self, positions: np.ndarray, tick: int = 0) -> None:
        self._segments: list[Segment] = []
        self.hold(positions, tick)

    def hold(self, positions: np.ndarray, tick: int) -> None:
        """Forget everything and stay at `positions` (J,) from `tick` on."""
        still = np.zeros((1, len(positions)))
        here = np.array(positions, dtype=float)[None, :]
        self._segments = [Segment(tick, Samples(here, still, still))]

    def splice(self, segment: Segment) -> None:
        """Let `segment` replace everything from its start on."""
        self._segments = [kept for kept in self._segments if kept.start < segment.start] + [segment]

    def at(self, tick: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return position, velocity and acceleration (J,) at `tick`; views, not to be written."""
        segment = self._segments[0]
        for later in self._segments[1:]:
            if later.start > tick:
                break
            segment = later
        index = min(max(tick, segment.start), segment.end) - segment.start
        samples = segment.samples
        return samples.positions[index], samples.velocities[index], samples.accelerations[index]

    def coming(self, tick: int) -> Samples:
        """Return the samples from `tick` to the end of the last segment, at least one."""
        rows = [self.at(later) for later in range(tick, max(tick, self.end) + 1)]
        return Samples(*(np.array(column) for column in zip(*rows, strict=True)))

    def forget_before(self, tick: int) -> None:
        """Drop the segments that `tick` has left behind."""
        while len(self._segments) > 1 and self._segments[1].start <= tick:
            del self._segments[0]

    @property
    def end(self) -> int:
        """Tick from which the reference is at rest for good."""
        return self._segments[-1].end
