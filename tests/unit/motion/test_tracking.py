import numpy as np

from motion.tracking import tracking_acceleration


def test_tracking_acceleration_is_equation_11() -> None:
    g, dg, ddg = np.array([1.0, 2.0]), np.array([0.5, -0.5]), np.array([3.0, 4.0])
    y, v = np.array([0.9, 2.2]), np.array([0.4, -0.3])
    expected = 20 * (5 * (g - y) + dg - v) + ddg
    assert np.allclose(tracking_acceleration(20.0, (g, dg, ddg), y, v), expected, rtol=1e-14)


def test_tracking_acceleration_writes_into_out_and_leaves_its_inputs() -> None:
    inputs = [np.array([float(k)]) for k in range(5)]
    before = [x.copy() for x in inputs]
    out = np.empty(1)
    assert tracking_acceleration(8.0, (inputs[0], inputs[1], inputs[2]), inputs[3], inputs[4], out=out) is out
    assert inputs == before


def test_tracking_is_critically_damped() -> None:
    """A disturbed joint returns like (1 + αt/2)·exp(−αt/2), without overshoot."""
    alpha, h = 50.0, 1e-5
    y, v = np.array([0.1]), np.array([0.0])
    rest = np.zeros(1)
    for _ in range(20000):
        v = v + h * tracking_acceleration(alpha, (rest, rest, rest), y, v)
        y = y + h * v
    assert np.isclose(y[0], 0.1 * (1 + alpha * 0.2 / 2) * np.exp(-alpha * 0.2 / 2), rtol=1e-2)
