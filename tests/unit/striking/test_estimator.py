import numpy as np
import pytest

from robot.striking.estimator import Estimator, NoBall, NoiseModel
from robot.striking.flight import Air, Ball, Court, Surface
from robot.striking.learning import outgoing_velocity

BALL = Ball(0.057, 0.033, drag=0.02, step=0.001)
COURT = Court(Surface(0.0, 0.75, tangential=0.8, dwell=0.004, spread=0.0))
START, SPEED = np.array([3.0, 0.2, 1.0]), np.array([-5.0, 0.3, 2.5])


def flight(restitution: float = 0.75, seconds: float = 1.2) -> np.ndarray:
    """Return true positions (n, 3), m, at 1 kHz, integrated as in the simulation; a bounce takes 4 ms."""
    position, velocity, found, waits, slide = START.copy(), SPEED.copy(), [], 0, np.zeros(3)
    for _ in range(round(seconds * 1000)):
        found.append(position.copy())
        if waits:
            waits -= 1
            position = position + 1e-3 * slide
            continue
        velocity = velocity + 1e-3 * (np.array([0, 0, -9.81]) - BALL.drag * np.linalg.norm(velocity) * velocity)
        position = position + 1e-3 * velocity
        if position[2] < BALL.radius and velocity[2] < 0:
            slide = velocity * [0.9, 0.9, 0.0]
            velocity = velocity * [0.8, 0.8, -restitution]
            position[2] = BALL.radius
            waits = 4
    return np.array(found)


def watch(estimator: Estimator, seen: np.ndarray, until: int, every: int = 10, std: float = 0.0, seed: int = 0) -> None:
    rng = np.random.default_rng(seed)
    for k in range(0, until, every):
        estimator.observe(k * 1e-3, seen[k] + std * rng.normal(size=3))


def test_exact_sights_predict_the_flight_beyond_the_bounce():
    seen, estimator = (
        flight(),
        Estimator(BALL, COURT, NoiseModel(1e-5, restitution_std=1e-3, drag_std=1e-3, unmodelled=1e-3)),
    )
    watch(estimator, seen, 200)
    path = estimator.path(1.1)
    positions, _ = path.at(np.array([0.4, 0.9, 1.05]))
    assert path.bounced(np.array([0.4, 1.05])).tolist() == [0, 1]
    assert positions == pytest.approx(seen[[400, 900, 1050]], abs=5e-3)


def test_the_estimation_error_is_consistent_with_the_covariance():
    """The mean normalised squared error of position and velocity is near 6, before and after the bounce."""
    rng = np.random.default_rng(1)
    for until in (300, 950):
        scores = []
        for seed in range(20):
            restitution = 0.75 + 0.05 * rng.normal()
            seen = flight(restitution)
            estimator = Estimator(BALL, COURT, NoiseModel(0.005, restitution_std=0.05, drag_std=0.01))
            watch(estimator, seen, until, std=0.005, seed=seed)
            found = estimator.estimate
            assert found is not None
            k = round(found.time * 1e3)
            truth = np.concatenate([seen[k], (seen[k + 1] - seen[k - 1]) / 2e-3])
            beside = found.mean[:6] - truth
            scores.append(beside @ np.linalg.solve(found.covariance[:6, :6], beside))
        assert 3.0 < np.mean(scores) < 10.0


def test_a_bounce_increases_the_covariance_and_its_sights_the_knowledge_of_restitution():
    seen, estimator = flight(0.68), Estimator(BALL, COURT, NoiseModel(0.002, restitution_std=0.05))
    watch(estimator, seen, 500, std=0.002)
    path = estimator.path(1.1)
    before, after = (path.covariance(np.array([time]))[0, 5, 5] for time in (0.6, 0.9))
    assert after > 10 * before
    watch(estimator, seen, 1000, std=0.002)
    assert estimator.estimate is not None
    assert estimator.estimate.restitution == pytest.approx(0.68, abs=0.02)


def test_implausible_sights_are_rejected_and_repeated_ones_are_a_new_ball():
    seen, estimator = flight(), Estimator(BALL, COURT)
    watch(estimator, seen, 200)
    assert estimator.observe(0.2, np.array([np.nan, 0, 0])) == "rejected"
    assert estimator.observe(0.1, seen[100]) == "rejected"
    assert estimator.observe(0.2, seen[200] + [0, 1.0, 0]) == "rejected"
    assert estimator.observe(0.21, seen[210]) == "used"
    other = seen + np.array([0.0, 2.0, 0.0])
    assert [estimator.observe(k * 1e-3, other[k]) for k in (220, 230, 240)] == ["rejected", "rejected", "new ball"]


def test_lost_sights_are_bridged_and_the_age_of_the_last_one_known():
    seen, estimator = flight(), Estimator(BALL, COURT, NoiseModel(0.005, latency=0.01))
    assert estimator.age(5.0) == np.inf
    with pytest.raises(NoBall):
        estimator.path(1.0)
    for k in (0, 10, 20, 30, 180):
        estimator.observe(k * 1e-3 + 0.01, seen[k])
    assert estimator.estimate is not None
    assert estimator.estimate.time == pytest.approx(0.18)
    assert estimator.age(0.5) == pytest.approx(0.31)


def test_wind_is_estimated_from_sights():
    wind, estimator = np.array([0.0, 0.8, 0.0]), Estimator(Ball(0.1, 0.03), COURT, NoiseModel(1e-4, wind_std=(1, 1, 0)))
    for time in np.arange(0, 0.3, 0.01):
        fall = np.array([0, 0, -9.81]) + wind
        estimator.observe(time, np.array([0, 0, 5.0]) + np.array([2.0, 0, 0]) * time + fall * time**2 / 2)
    assert estimator.estimate is not None
    assert estimator.estimate.mean[6:9] == pytest.approx(wind, abs=0.02)


def test_the_outgoing_velocity_is_estimated_from_sights():
    ball = Ball(0.057, 0.033, step=0.001)
    times = np.arange(0.02, 0.12, 0.01)
    fall = np.array([0, 0, -9.81]) * (times * (times + ball.step) / 2)[:, None]
    seen = np.array([1.0, 0, 1.0]) + times[:, None] * np.array([5.0, 1.0, 3.0]) + fall
    found = outgoing_velocity((times + 2.0).tolist(), seen, 2.0, ball, Air())
    assert found is not None
    assert found[0] == pytest.approx([5.0, 1.0, 3.0], abs=1e-6)
    assert outgoing_velocity([2.1], seen[:1], 2.0, ball, Air()) is None
