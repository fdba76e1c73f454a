"""What is kept of a demonstration, in memory and on disk."""

from pathlib import Path

import numpy as np
import pytest

from motion.demonstration import Demonstration, SavitzkyGolay
from motion.errors import InvalidMotion
from motion.primitive import Primitive, learn
from tests.unit.motion.recordings import strike

DEMOS = Path(__file__).parents[4] / "shared" / "demos"
S = np.linspace(0, 1, 1001)


def test_the_figures_demonstration_is_learned(figure: Primitive) -> None:
    assert (figure.joint_count, figure.basis_count, figure.samples, figure.duration) == (1, 50, 1001, 1.0)
    assert figure.start.positions == pytest.approx([0], abs=1e-7)
    assert figure.start.velocities == pytest.approx([-1], abs=1e-4)
    assert figure.goal.positions == pytest.approx([1], abs=1e-7)
    assert figure.goal.velocities == pytest.approx([3], abs=1e-4)
    assert np.abs(figure.positions(S)[:, 0] - strike(S)).max() < 1e-7
    assert figure.position_max[0] < 1e-7
    assert figure.position_rms[0] <= figure.position_max[0]


def test_samples_are_each_other_s_derivatives(figure: Primitive) -> None:
    """At the demonstration's own speed; the weights are those of the acceleration."""
    slow = learn(Demonstration(2 * S, strike(S)[:, None]))
    fast, half = figure.sample(S), slow.sample(S)
    assert np.allclose(half.positions, fast.positions, atol=1e-7)
    assert np.allclose(2 * half.velocities, fast.velocities, atol=1e-4)
    assert np.allclose(4 * half.accelerations, fast.accelerations, atol=1e-1)
    assert np.allclose(np.gradient(fast.positions[:, 0], S)[1:-1], fast.velocities[1:-1, 0], atol=1e-3)
    assert np.allclose(np.gradient(fast.velocities[:, 0], S)[1:-1], fast.accelerations[1:-1, 0], atol=2e-2)
    assert figure.weights.shape == (1, 50)
    assert figure.weights[0, [0, -1]] == pytest.approx(fast.accelerations[[0, -1], 0])


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
    assert (after.duration, after.samples, after.basis_count) == (before.duration, 200, 20)


def test_malformed_arrays_are_refused_by_name(figure: Primitive) -> None:
    arrays = figure.to_arrays()
    for name in arrays.keys() - {"spread"}:
        with pytest.raises(InvalidMotion, match="is missing") as refusal:
            Primitive.from_arrays({k: v for k, v in arrays.items() if k != name})
        assert refusal.value.field == name
        if name != "smoothing":
            with pytest.raises(InvalidMotion) as refusal:
                Primitive.from_arrays(arrays | {name: np.ones((2, 2, 2, 2))})
            assert refusal.value.field == name
    with pytest.raises(InvalidMotion, match="smoothing"):
        Primitive.from_arrays(arrays | {"smoothing": np.ones(3)})
    with pytest.raises(InvalidMotion, match="finite"):
        Primitive.from_arrays(arrays | {"control_points": arrays["control_points"] * np.nan})
    with pytest.raises(InvalidMotion, match="duration"):
        Primitive.from_arrays(arrays | {"duration": np.array(0.0)})
    with pytest.raises(InvalidMotion, match="basis_count"):
        Primitive.from_arrays(arrays | {"control_points": np.zeros((1, 12))})


def gaussian_arrays(positions: np.ndarray, duration: float) -> dict[str, np.ndarray]:
    """What the version of the Gaussian weights wrote of smoothed positions (1001, J)."""
    joints = positions.shape[1]
    accelerations = np.gradient(np.gradient(positions, duration / 1000, axis=0), duration / 1000, axis=0)
    return {
        "duration": np.array(duration),
        "theta": np.zeros((joints, 50)),
        "positions": positions,
        "accelerations": accelerations,
        "ends": np.zeros((2, 3, joints)),
        "samples": np.array(321),
        "fit_rms": np.full(joints, 0.5),
        "noise_estimate": np.full(joints, 2e-4),
        "smoothing": np.array([0.1, 5.0]),
    }


def test_the_form_with_gaussian_weights_is_read() -> None:
    """Its positions are what it showed; what was known of the recording is kept."""
    positions = np.stack([strike(S), np.full(1001, 0.3)], axis=1)
    primitive = Primitive.from_arrays(gaussian_arrays(positions, 2.0))
    assert np.abs(primitive.positions(S) - positions).max() < 1e-6
    assert (primitive.duration, primitive.samples, primitive.basis_count) == (2.0, 321, 50)
    assert primitive.smoothing == SavitzkyGolay(0.1, 5)
    assert primitive.noise_estimate.tolist() == [2e-4, 2e-4]
    assert primitive.start.velocities == pytest.approx([-0.5, 0], abs=1e-3)


@pytest.mark.parametrize(
    ("name", "value"),
    [("positions", np.zeros((7, 2))), ("positions", np.full((1001, 2), np.nan)), ("duration", np.array(-1.0))],
)
def test_a_malformed_one_is_refused_by_name(name: str, value: np.ndarray) -> None:
    arrays = gaussian_arrays(np.zeros((1001, 2)), 1.0)
    for broken in (arrays | {name: value}, {k: v for k, v in arrays.items() if k != name}):
        with pytest.raises(InvalidMotion) as refusal:
            Primitive.from_arrays(broken)
        assert refusal.value.field == name


@pytest.mark.parametrize("count", [0, 19, 401])
def test_basis_count_is_bounded(count: int) -> None:
    t = np.linspace(0, 1, 100)
    with pytest.raises(InvalidMotion, match="basis_count"):
        learn(Demonstration(t, t[:, None]), basis_count=count)


@pytest.mark.skipif(not DEMOS.is_dir(), reason="the shared recordings are not here")
def test_recordings_of_an_arm_are_followed() -> None:
    """Within 1 % of each joint's range, or what their own steps allow."""
    paths = sorted(DEMOS.glob("*.csv"))
    recordings = [np.loadtxt(path, delimiter=",", skiprows=1)[:, 1:] for path in paths]
    recordings += list(np.load(DEMOS / "robottasks_pouring_ee.npz")["pose"][:2])
    assert len(recordings) > 3
    for positions in recordings:
        primitive = learn(Demonstration(np.linspace(0, 4, len(positions)), positions))
        steps = np.abs(np.diff(positions, axis=0)).max(axis=0)
        assert np.all(primitive.position_max < np.maximum(np.maximum(0.01 * np.ptp(positions, axis=0), 0.005), steps))
        assert np.all(primitive.position_rms < 0.0035)
