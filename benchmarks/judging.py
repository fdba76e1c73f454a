"""The performance of a solver over many goals of one joint, judged from the accelerations alone."""

from dataclasses import dataclass, field

import numpy as np

from benchmarks.timing import milliseconds
from motion.primitive import Primitive
from motion.request import MotionRequest

FINE = np.linspace(0, 1, 10001)
"""Instants at which motions are judged, ten times finer than those of the full problem."""


@dataclass
class Column:
    """The results of one solver.

    seconds: of each solved goal. violations: the worst of each, as a part of half a limit's range. errors: of the
    imitation, as a part of the demonstration's rms acceleration. unsolved: number of goals.
    """

    seconds: list[float] = field(default_factory=list)
    violations: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    unsolved: int = 0

    def summary(self) -> dict[str, float]:
        """Return milliseconds, the worst violation and the median error."""
        worst = {"violation": max(self.violations, default=np.nan), "error": float(np.median(self.errors or [np.nan]))}
        return {**milliseconds(self.seconds), **worst, "solved": len(self.violations), "unsolved": self.unsolved}

    def judge(self, primitive: Primitive, request: MotionRequest, accelerations: np.ndarray) -> None:
        """Integrate accelerations (n,), equally spaced over the motion, and append violation and imitation error."""
        s = np.linspace(0, 1, len(accelerations))
        step = request.duration / (len(s) - 1)
        velocities = _integrated(accelerations, step, request.start.velocities[0])
        positions = _integrated(velocities, step, request.start.positions[0])
        jerks = np.diff(accelerations) / step
        outside = 0.0
        curves = positions, velocities, accelerations, jerks
        for values, (low, high) in zip(curves, request.limits.ranges[0], strict=True):
            outside = max(outside, float(max(values.max() - high, low - values.min()) / ((high - low) / 2)))
        wanted = (primitive.duration / request.duration) ** 2 * primitive.sample(s).accelerations[:, 0]
        self.violations.append(outside)
        self.errors.append(float(np.sqrt(np.mean((accelerations - wanted) ** 2) / np.mean(wanted**2))))


def _integrated(values: np.ndarray, step: float, start: float) -> np.ndarray:
    return start + np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * step)])
