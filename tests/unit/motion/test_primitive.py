"""Primitives learned from demonstrations."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motion.demonstration import Demonstration
from motion.errors import InvalidMotion
from motion.primitive import Primitive, learn
from tests.unit.motion.recordings import strike

DEMOS = Path(__file__).parents[4] / "shared" / "demos"
S = np.linspace(0, 1, 1001)


def test_the_demonstration_of_the_figures_is_learned(figure: Primitive) -> None:
    assert (figure.joint_count, figure.basis_count, figure.samples, figure.duration) == (1, 50, 1001, 1.0)
    assert figure.start.positions == pytest.approx([0], abs=1e-7)
    assert figure.start.velocities == pytest.approx([-1], abs=1e-4)
    assert figure.goal.positions == pytest.approx([1], abs=1e-7)
    assert figure.goal.velocities == pytest.approx([3], abs=1e-4)
    assert np.abs(figure.positions(S)[:, 0] - strike(S)).max() < 1e-7
    assert figure.position_max[0] < 1e-7
    assert figure.position_rms[0] <= figure.position_max[0]


def test_velocities_and_accelerations_are_derivatives_at_any_duration(figure: Primitive) -> None:
    """The weights are those of the acceleration."""
    slow = learn(Demonstration(2 * S, strike(S)[:, None]))
    fast, half = figure.sample(S), slow.sample(S)
    assert np.allclose(half.positions, fast.positions, atol=1e-7)
    assert np.allclose(2 * half.velocities, fast.velocities, atol=1e-4)
    assert np.allclose(4 * half.accelerations, fast.accelerations, atol=1e-1)
    assert np.allclose(np.gradient(fast.positions[:, 0], S)[1:-1], fast.velocities[1:-1, 0], atol=1e-3)
    assert np.allclose(np.gradient(fast.velocities[:, 0], S)[1:-1], fast.accelerations[1:-1, 0], atol=2e-2)
    assert figure.weights.shape == (1, 50)
    assert figure.weights[0, [0, -1]] == pytest.approx(fast.accelerations[[0, -1], 0])


@pytest.mark.parametrize("field", ["duration", "control_points"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_primitive_has_finite_numbers(figure: Primitive, field: str, value: float) -> None:
    with pytest.raises(InvalidMotion, match=f"{field}: .*finite"):
        replace(figure, **{field: getattr(figure, field) + value})


@pytest.mark.parametrize("count", [0, 19, 401])
def test_basis_count_is_bounded(count: int) -> None:
    t = np.linspace(0, 1, 100)
    with pytest.raises(InvalidMotion, match="basis_count"):
        learn(Demonstration(t, t[:, None]), basis_count=count)


@pytest.mark.skipif(not DEMOS.is_dir(), reason="the shared recordings are not here")
def test_recordings_of_an_arm_are_fitted() -> None:
    """Within 1 % of each joint's range, or within the recording's largest step."""
    paths = sorted(DEMOS.glob("*.csv"))
    recordings = [np.loadtxt(path, delimiter=",", skiprows=1)[:, 1:] for path in paths]
    recordings += list(np.load(DEMOS / "robottasks_pouring_ee.npz")["pose"][:2])
    assert len(recordings) > 3
    for positions in recordings:
        primitive = learn(Demonstration(np.linspace(0, 4, len(positions)), positions))
        steps = np.abs(np.diff(positions, axis=0)).max(axis=0)
        assert np.all(primitive.position_max < np.maximum(np.maximum(0.01 * np.ptp(positions, axis=0), 0.005), steps))
        assert np.all(primitive.position_rms < 0.0035)
