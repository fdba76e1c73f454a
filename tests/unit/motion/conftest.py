"""Fixtures for tests of motion: the demonstration of the paper's figures, its limits, and a factory of requests."""

from collections.abc import Callable

import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest

TIMES = np.linspace(0, 1, 1001)


@pytest.fixture(scope="session")
def figure() -> Primitive:
    """The demonstration of the paper's one-joint figures: d(t) = 2t² + cos(4πt)(1−t) − 1."""
    positions = 2 * TIMES**2 + np.cos(4 * np.pi * TIMES) * (1 - TIMES) - 1
    return learn(Demonstration(TIMES, positions[:, None]))


@pytest.fixture(scope="session")
def paper_limits() -> Limits:
    """Limits of one joint within which the paper's cases are feasible."""
    return Limits(np.array([[-2.0, 2.0]]), np.array([15.0]), np.array([300.0]), np.array([15000.0]))


@pytest.fixture(scope="session")
def ask() -> Callable[..., MotionRequest]:
    """Makes requests of one joint; start and goal are (position, velocity[, acceleration])."""

    def make(
        start: tuple[float, ...] = (0.0, -1.0),
        goal: tuple[float, ...] = (1.0, 3.0),
        duration: float = 1.0,
        limits: Limits | None = None,
        **more: object,
    ) -> MotionRequest:
        ends = [Boundary(*(np.array([x]) for x in (*end, np.nan)[:3])) for end in (start, goal)]
        return MotionRequest(ends[0], ends[1], duration, limits or Limits.unlimited(1), **more)  # type: ignore[arg-type]

    return make
