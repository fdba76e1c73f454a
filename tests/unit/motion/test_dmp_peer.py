"""The DMPs beside those of the independent package movement-primitives.

Its DMPWithFinalVelocity is not quite eq. 6–7: it takes a demonstration to start at rest and keeps its final
acceleration as the goal's. So both are compared on one that starts at rest and ends without acceleration. Its
DMP does not scale the forcing term by the amplitude of the goal, so goals have the demonstration's.
"""

import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.dmp import learn_dmp, moving_goal
from motion.primitive import Primitive, learn
from motion.request import Boundary

peer = pytest.importorskip("movement_primitives.dmp")

S = np.linspace(0, 1, 1001)
REST = Boundary(np.zeros(1), np.zeros(1), np.full(1, np.nan))


def moved(position: float, velocity: float) -> Boundary:
    """A state of one joint."""
    return Boundary(np.array([position]), np.array([velocity]), np.full(1, np.nan))


def strike(velocity: float) -> Demonstration:
    """From rest at 0 to 1 rad at `velocity` by a detour, without acceleration at either end."""
    detour = np.sin(2 * np.pi * S) ** 4 * (1 - S)
    return Demonstration(S, moving_goal("polynomial", REST, moved(1.0, velocity), 1.0, S)[0] + 0.4 * detour[:, None])


@pytest.fixture(scope="module")
def hit() -> Primitive:
    """A strike that arrives at 3 rad/s."""
    return learn(strike(3.0), "none")


@pytest.mark.parametrize(
    ("position", "velocity", "duration"), [(1.0, 3.0, 1.0), (0.4, 6.0, 1.0), (-0.8, -2.0, 1.0), (1.5, 1.0, 0.8)]
)
def test_the_polynomial_goal_agrees(hit: Primitive, position: float, velocity: float, duration: float):
    """To 1 % of the path and 3 % of the speed, which the regressions and Euler steps of both leave."""
    theirs = peer.DMPWithFinalVelocity(1, execution_time=1.0, dt=0.001, n_weights_per_dim=100, int_dt=0.001)
    theirs.imitate(S, strike(3.0).positions)
    theirs.execution_time_ = duration
    theirs.configure(goal_y=np.array([position]), goal_yd=np.array([velocity]), goal_ydd=np.zeros(1))
    _, path = theirs.open_loop(run_t=duration)
    ours = learn_dmp(hit).rollout(REST, moved(position, velocity), duration)
    reach, speed = np.ptp(ours.positions), np.abs(ours.velocities).max()
    assert np.abs(ours.positions - path).max() < 0.01 * reach
    assert np.abs(ours.velocities[1:-1] - np.gradient(path, 0.001, axis=0)[1:-1]).max() < 0.03 * speed


@pytest.mark.parametrize(("start", "duration"), [(0.0, 1.0), (0.7, 1.0), (-0.5, 0.6)])
def test_the_discrete_one_agrees(start: float, duration: float):
    """For start and goal moved together and another duration."""
    demonstration = strike(0.0)
    theirs = peer.DMP(1, execution_time=1.0, dt=0.001, n_weights_per_dim=100, int_dt=0.001)
    theirs.imitate(S, demonstration.positions)
    theirs.execution_time_ = duration
    theirs.configure(start_y=np.array([start]), goal_y=np.array([start + 1.0]))
    _, path = theirs.open_loop(run_t=duration)
    ours = learn_dmp(learn(demonstration, "none"), "discrete")
    got = ours.rollout(moved(start, 0.0), moved(start + 1.0, 0.0), duration).positions
    assert np.abs(got - path).max() < 0.01 * np.ptp(got)
