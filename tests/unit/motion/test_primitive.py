from pathlib import Path

import numpy as np
import pytest

from motion.demonstration import Demonstration, SavitzkyGolay
from motion.errors import InvalidMotion
from motion.primitive import Primitive, learn

DEMOS = Path(__file__).parents[4] / "shared" / "demos"


def test_the_figures_demonstration_is_fitted(figure: Primitive) -> None:
    assert figure.joint_count == 1
    assert figure.basis_count == 50
    assert figure.samples == 1001
    assert figure.start.positions == pytest.approx([0], abs=1e-4)
    assert figure.start.velocities == pytest.approx([-1], abs=1e-2)
    assert figure.goal.positions == pytest.approx([1], abs=1e-4)
    assert figure.goal.velocities == pytest.approx([3], abs=1e-2)
    # Of d̈ in closed form, 50 functions of this width miss 0.893 % at best (their projection, on 20,001 instants; 0.2 %
    # away from the ends): so the learned θ is as good as the basis allows.
    rms = np.sqrt(np.mean(figure.accelerations**2))
    assert figure.fit_rms[0] / rms == pytest.approx(0.00893, abs=1e-4)


def test_a_longer_demonstration_has_the_same_theta(figure: Primitive) -> None:
    """θ belongs to normalised time: a demonstration played at half the speed differs in T_d alone."""
    t = np.linspace(0, 1, 1001)
    positions = 2 * t**2 + np.cos(4 * np.pi * t) * (1 - t) - 1
    slow = learn(Demonstration(2 * t, positions[:, None]))
    assert slow.duration == 2
    assert np.allclose(slow.theta, figure.theta, rtol=1e-9, atol=1e-9)
    assert np.allclose(4 * slow.accelerations, figure.accelerations, rtol=1e-9, atol=1e-7)


@pytest.mark.parametrize("smoothing", ["auto", "none", SavitzkyGolay(0.1, 4)])
def test_round_trip_is_exact(tmp_path: Path, smoothing: SavitzkyGolay) -> None:
    t = np.linspace(0, 1.3, 200)
    before = learn(Demonstration(t, np.stack([np.sin(t), t**2], axis=1)), smoothing, basis_count=20)
    np.savez(tmp_path / "p.npz", **before.to_arrays())  # type: ignore[arg-type]
    with np.load(tmp_path / "p.npz") as stored:
        after = Primitive.from_arrays(stored)
    arrays = after.to_arrays()
    for name, values in before.to_arrays().items():
        assert np.array_equal(values, arrays[name]), name
    assert after.smoothing == before.smoothing
    assert after.duration == before.duration


def test_malformed_arrays_are_refused_by_name(figure: Primitive) -> None:
    arrays = figure.to_arrays()
    for name in arrays:
        with pytest.raises(InvalidMotion, match="is missing"):
            Primitive.from_arrays({k: v for k, v in arrays.items() if k != name})
    for name in ("theta", "positions", "ends", "fit_rms", "samples"):
        with pytest.raises(InvalidMotion) as refusal:
            Primitive.from_arrays(arrays | {name: np.ones((2, 2, 2, 2))})
        assert refusal.value.field == name
    with pytest.raises(InvalidMotion, match="finite"):
        Primitive.from_arrays(arrays | {"theta": arrays["theta"] * np.nan})
    with pytest.raises(InvalidMotion, match="duration"):
        Primitive.from_arrays(arrays | {"duration": np.array(0.0)})


def test_demonstrated_positions(figure: Primitive) -> None:
    assert figure.demonstrated_positions(np.array([0.5]))[0, 0] == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("count", [0, 9, 201])
def test_basis_count_is_bounded(count: int) -> None:
    t = np.linspace(0, 1, 100)
    with pytest.raises(InvalidMotion, match="basis_count"):
        learn(Demonstration(t, t[:, None]), basis_count=count)


@pytest.mark.skipif(not DEMOS.is_dir(), reason="the shared recordings are not here")
def test_seven_joint_recordings_are_learned() -> None:
    for path in sorted(DEMOS.glob("*.csv")):
        data = np.loadtxt(path, delimiter=",", skiprows=1)
        primitive = learn(Demonstration(4 * data[:, 0], data[:, 1:]), SavitzkyGolay(0.4, 5))
        assert primitive.joint_count == 7
        assert np.all(primitive.fit_rms < 0.2 * np.sqrt(np.mean(primitive.accelerations**2, axis=0)))
