"""DMPs compared with those of the independent package movement-primitives.

Its DMPWithFinalVelocity differs from eq. 6–7: it assumes a demonstration that starts at rest and keeps its final
acceleration for every goal. So the demonstration here starts at rest and ends with zero acceleration. Its
DMP does not scale the forcing term by the goal's amplitude, so goals have the demonstration's amplitude.
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
    """Return a boundary state of one joint with free acceleration, rad and rad/s."""
    return Boundary(np.array([position]), np.array([velocity]), np.full(1, np.nan))


def strike(velocity: float) -> Demonstration:
    """Return a movement from rest at 0 to 1 rad at `velocity`, rad/s, by a detour; both end accelerations are 0."""
    detour = np.sin(2 * np.pi * S) ** 4 * (1 - S)
    return Demonstration(S, moving_goal("polynomial", REST, moved(1.0, velocity), 1.0, S)[0] + 0.4 * detour[:, None])


@pytest.fixture(scope="module")
def hit() -> Primitive:
    """A strike that arrives at 3 rad/s."""
    return learn(strike(3.0), "none")


@pytest.mark.parametrize(
    ("position", "velocity", "duration"), [(1.0, 3.0, 1.0), (0.4, 6.0, 1.0), (-0.8, -2.0, 1.0), (1.5, 1.0, 0.8)]
)
def test_polynomial_goals_agree_with_the_peer(hit: Primitive, position: float, velocity: float, duration: float):
    """Within 1 % of the path and 3 % of the speed: the errors of regression and of Euler's rule in both packages."""
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
def test_the_discrete_system_agrees_with_the_peer(start: float, duration: float):
    """With start and goal shifted by the same amount, and for another duration."""
    demonstration = strike(0.0)
    theirs = peer.DMP(1, execution_time=1.0, dt=0.001, n_weights_per_dim=100, int_dt=0.001)
    theirs.imitate(S, demonstration.positions)
    theirs.execution_time_ = duration
    theirs.configure(start_y=np.array([start]), goal_y=np.array([start + 1.0]))
    _, path = theirs.open_loop(run_t=duration)
    ours = learn_dmp(learn(demonstration, "none"), "discrete")
    got = ours.rollout(moved(start, 0.0), moved(start + 1.0, 0.0), duration).positions
    assert np.abs(got - path).max() < 0.01 * np.ptp(got)
