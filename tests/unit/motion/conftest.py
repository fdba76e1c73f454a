"""Fixtures for tests of motion: demonstrations, the limits of the paper's figures, and a factory of requests."""

import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.limits import Limits
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest
from tests.splines_of import TIMES, figure_strike, fitted
from tests.unit.motion.asking import Ask


@pytest.fixture(scope="session")
def figure() -> Primitive:
    """The demonstration of the paper's one-joint figures, as it is learned."""
    return learn(Demonstration(TIMES, figure_strike(TIMES)[:, None]))


@pytest.fixture(scope="session")
def strike() -> Primitive:
    """The demonstration of the paper's figures, fitted without smoothing by 50 basis functions."""
    return fitted(TIMES, figure_strike(TIMES)[:, None])


@pytest.fixture(scope="session")
def moves() -> Primitive:
    """Six moves of 1.5 s and 0.8 rad, there and back, with pauses; 20 s."""
    t = np.linspace(0, 20, 4001)
    positions = np.zeros_like(t)
    for k in range(6):
        s = np.clip((t - 1 - 3.1 * k) / 1.5, 0, 1)
        positions += (-1) ** k * 0.8 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    return fitted(t, positions[:, None], 200)


@pytest.fixture(scope="session")
def paper_limits() -> Limits:
    """Limits of one joint within which the paper's cases are feasible."""
    return Limits(np.array([[-2.0, 2.0]]), np.array([15.0]), np.array([300.0]), np.array([15000.0]))


@pytest.fixture(scope="session")
def ask() -> Ask:
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
