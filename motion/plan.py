"""From a primitive and a request to a verified motion."""

from dataclasses import dataclass

import numpy as np

from motion.primitive import Primitive
from motion.request import MotionRequest
from motion.samples import Samples


@dataclass(frozen=True, slots=True)
class Warm:
    """Rows that carried multipliers, per joint: a start for the next plan of the same joints."""

    rows: tuple[np.ndarray, ...]


@dataclass(frozen=True, slots=True)
class Active:
    """A limit that shapes the motion."""

    joint: int
    quantity: str
    time_from_start: float


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """What a plan promises, recomputed from its weights."""

    imitation_rms: np.ndarray
    final_error_positions: np.ndarray
    final_error_velocities: np.ndarray
    extremes: dict[str, np.ndarray]
    margin: dict[str, np.ndarray]
    active: tuple[Active, ...]
    certified: bool
    rounds: int
    rows: int


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A verified motion with its tail."""

    request: MotionRequest
    duration: float
    total_duration: float
    hit_index: int
    tick: float
    report: Report
    warm: Warm

    def sample(self, times: np.ndarray) -> Samples:
        """States at `times` (n,), s from the start; beyond the end the arm rests (or coasts)."""
        raise NotImplementedError

    def samples(self) -> Samples:
        """States on the tick grid, the first at 0, the last at `total_duration`."""
        raise NotImplementedError


def plan(primitive: Primitive, request: MotionRequest, tick: float = 0.001, warm: Warm | None = None) -> Plan:
    """Plan the motion that imitates `primitive` best as `request` asks."""
    raise NotImplementedError
