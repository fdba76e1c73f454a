"""Primitives as arrays on disk."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motion.demonstration import Demonstration, SavitzkyGolay
from motion.errors import InvalidMotion
from motion.primitive import Primitive, learn
from motion.program.imitation import place_weights
from services.planner.archive import from_arrays, to_arrays
from tests.unit.motion.recordings import strike

S = np.linspace(0, 1, 1001)


@pytest.fixture(scope="module")
def figure() -> Primitive:
    """The demonstration of the paper's figures."""
    return learn(Demonstration(S, strike(S)[:, None]))


@pytest.mark.parametrize("smoothing", ["auto", "none", SavitzkyGolay(0.1, 4)])
def test_round_trip_is_exact(tmp_path: Path, smoothing: SavitzkyGolay) -> None:
    t = np.linspace(0, 1.3, 200)
    before = learn(Demonstration(t, np.stack([np.sin(t), t**2], axis=1)), smoothing, basis_count=20)
    np.savez(tmp_path / "p.npz", **to_arrays(before))  # type: ignore[arg-type]
    with np.load(tmp_path / "p.npz") as stored:
        after = from_arrays(stored)
    arrays = to_arrays(after)
    for name, values in to_arrays(before).items():
        assert np.array_equal(values, arrays[name]), name
    assert after.smoothing == before.smoothing
    assert (after.duration, after.samples, after.basis_count) == (before.duration, 200, 20)


def test_missing_or_malformed_arrays_are_refused_by_name(figure: Primitive) -> None:
    arrays = to_arrays(figure)
    for name in arrays.keys() - {"spread"}:
        with pytest.raises(InvalidMotion, match="is missing") as refusal:
            from_arrays({k: v for k, v in arrays.items() if k != name})
        assert refusal.value.field == name
        if name != "smoothing":
            with pytest.raises(InvalidMotion) as refusal:
                from_arrays(arrays | {name: np.ones((2, 2, 2, 2))})
            assert refusal.value.field == name
    with pytest.raises(InvalidMotion, match="smoothing"):
        from_arrays(arrays | {"smoothing": np.ones(3)})
    with pytest.raises(InvalidMotion, match="finite"):
        from_arrays(arrays | {"control_points": arrays["control_points"] * np.nan})
    with pytest.raises(InvalidMotion, match="duration"):
        from_arrays(arrays | {"duration": np.array(0.0)})
    with pytest.raises(InvalidMotion, match="basis_count"):
        from_arrays(arrays | {"control_points": np.zeros((1, 12))})


def gaussian_arrays(positions: np.ndarray, duration: float) -> dict[str, np.ndarray]:
    """Return arrays as written by the version with Gaussian weights, for smoothed positions (1001, J)."""
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


def test_arrays_with_gaussian_weights_are_converted() -> None:
    """Positions and metadata of the recording are kept."""
    positions = np.stack([strike(S), np.full(1001, 0.3)], axis=1)
    primitive = from_arrays(gaussian_arrays(positions, 2.0))
    assert np.abs(primitive.positions(S) - positions).max() < 1e-6
    assert (primitive.duration, primitive.samples, primitive.basis_count) == (2.0, 321, 50)
    assert primitive.smoothing == SavitzkyGolay(0.1, 5)
    assert primitive.noise_estimate.tolist() == [2e-4, 2e-4]
    assert primitive.start.velocities == pytest.approx([-0.5, 0], abs=1e-3)


@pytest.mark.parametrize(
    ("name", "value"),
    [("positions", np.zeros((7, 2))), ("positions", np.full((1001, 2), np.nan)), ("duration", np.array(-1.0))],
)
def test_malformed_arrays_with_gaussian_weights_are_refused_by_name(name: str, value: np.ndarray) -> None:
    arrays = gaussian_arrays(np.zeros((1001, 2)), 1.0)
    for broken in (arrays | {name: value}, {k: v for k, v in arrays.items() if k != name}):
        with pytest.raises(InvalidMotion) as refusal:
            from_arrays(broken)
        assert refusal.value.field == name


def test_a_spread_is_kept_and_older_primitives_have_none(figure: Primitive) -> None:
    primitive = replace(figure, spread=np.linspace(0.01, 0.06, 101)[None])
    arrays = to_arrays(primitive)
    assert np.array_equal(from_arrays(arrays).spread, primitive.spread)
    older = from_arrays({name: values for name, values in arrays.items() if name != "spread"})
    assert older.spread.shape == (1, 0)
    assert place_weights(older, 0.0, 1.0) == ()
