"""Properties of learning, for random movements and recordings."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from motion import splines
from motion.demonstration import Demonstration
from motion.primitive import MAX_BASIS, MIN_BASIS, learn
from services.planner.archive import from_arrays, to_arrays

SEEDS = st.integers(0, 2**32 - 1)


def movement(seed: int, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (5, 2), Hz, and sizes (5, 2), rad, of two joints' sines: at most 3 Hz and 60 periods."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0.05, min(3, 60 / duration), (5, 2)), rng.uniform(0.02, 0.3, (5, 2))


def shown(times: np.ndarray, seed: int, duration: float) -> np.ndarray:
    """Return the positions (n, 2) of the movement drawn by `seed`."""
    frequencies, sizes = movement(seed, duration)
    return (sizes * np.sin(2 * np.pi * frequencies * times[:, None, None] + seed % 7)).sum(axis=1)


@settings(max_examples=40, deadline=None)
@given(
    seed=SEEDS,
    duration=st.floats(0.3, 20),
    rate=st.sampled_from([100, 200, 500]),
    noise=st.sampled_from([0.0, 1e-4, 1e-3]),
    tick=st.sampled_from([None, 1e-3, 2 * np.pi / 4096]),
    jitter=st.sampled_from([0.0, 0.3, 0.49]),
)
def test_places_are_kept(seed: int, duration: float, rate: int, noise: float, tick: float | None, jitter: float):
    """Positions are learned within 1 % of the range or 5 mrad, with noise, encoders and uneven times."""
    rng = np.random.default_rng(seed)
    times = np.arange(round(duration * rate) + 1) / rate
    times = times + rng.uniform(-jitter, jitter, len(times)) / rate
    true = shown(times, seed, duration)
    recorded = true + noise * rng.standard_normal(true.shape)
    recorded = np.round(recorded / tick) * tick if tick else recorded
    demonstration = Demonstration(times, recorded)
    primitive = learn(demonstration)
    assert MIN_BASIS <= primitive.basis_count <= MAX_BASIS
    beside = np.abs(primitive.positions(demonstration.phases) - true).max(axis=0)
    assert np.all(beside < np.maximum(0.01 * np.ptp(true, axis=0), 0.005))


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, count=st.integers(MIN_BASIS, MAX_BASIS))
def test_a_spline_is_learned_as_itself(seed: int, count: int):
    """Without smoothing, the control points of a spline in the planner's space are recovered."""
    points = np.random.default_rng(seed).standard_normal((1, count + 2))
    s = np.linspace(0, 1, 8 * count)
    demonstration = Demonstration(s, splines.derivative(points, s, 0))
    found = learn(demonstration, "none", basis_count=count)
    assert np.abs(found.control_points - points).max() < 1e-4


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, samples=st.integers(10, 60), slower=st.floats(0.1, 10), shift=st.floats(-100, 100))
def test_learning_is_invariant_to_speed_and_shift(seed: int, samples: int, slower: float, shift: float):
    """A recording at another speed, shifted in time and position, gives the same primitive."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.5, 1.5, samples))
    positions = np.cumsum(rng.standard_normal((samples, 1)) * 0.01, axis=0)
    one = learn(Demonstration(times, positions), basis_count=30)
    two = learn(Demonstration(slower * times - shift, positions + shift / 100), basis_count=30)
    assert np.allclose(two.control_points - shift / 100, one.control_points, atol=1e-5)
    assert np.allclose(two.position_max, one.position_max, atol=1e-5)


@settings(max_examples=25, deadline=None)
@given(
    values=st.lists(st.floats(-1e4, 1e4), min_size=10, max_size=60),
    gaps=st.lists(st.floats(1e-9, 10), min_size=59, max_size=59),
)
def test_any_samples_give_finite_numbers(values: list[float], gaps: list[float]):
    """Random samples at increasing times give finite numbers, which survive storage."""
    times = np.concatenate([[0.0], np.cumsum(gaps)])[: len(values)]
    primitive = learn(Demonstration(times, np.array(values)[:, None]))
    again = from_arrays(to_arrays(primitive))
    assert np.array_equal(again.control_points, primitive.control_points)
    assert np.all(primitive.position_rms <= primitive.position_max * (1 + 1e-9))
