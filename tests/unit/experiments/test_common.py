"""The demonstration of the figures, and the closed forms on which the comparison is based."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="the extra `paper` is not installed")

from experiments.common import TIMES, ask, demonstrated, figure_primitive, gaussian, qp, rms, state
from experiments.fig2 import exact_deviations


def test_the_demonstration_has_the_known_values():
    """d(0) = 0, ḋ(0) = −1, d(1) = 1, ḋ(1) = 3, d(½) = 0, ḋ(½) = 1, and each row the derivative."""
    p, v, a = demonstrated(TIMES)
    assert np.allclose((p[0], v[0], p[-1], v[-1], p[500], v[500]), (0, -1, 1, 3, 0, 1))
    assert np.allclose(np.gradient(p, TIMES)[1:-1], v[1:-1], atol=1e-3)
    assert np.allclose(np.gradient(v, TIMES)[1:-1], a[1:-1], atol=2e-2)


@pytest.mark.parametrize(("method", "ends"), [(gaussian, 200), (qp, 0)])
def test_the_closed_form_of_the_deviation_agrees_with_the_programs(method, ends: int):
    """Both programs deviate by the closed form's line, the Gaussians except for ringing at the ends."""
    request = ask(state(0.5, -2.0), state(0.0, 6.0), 0.8)
    _, motion = method(figure_primitive(), request)
    count = motion.shape[1]
    deviation = motion[2] - demonstrated(np.linspace(0, 1, count))[2] / 0.8**2
    _, exact = exact_deviations(request, count)
    inner = slice(ends, len(exact) - ends)
    assert np.abs(deviation - exact)[inner].max() < 0.02 * rms(exact)


def test_the_exact_ratio_lies_between_its_bounds():
    """1.095 to 1.195 for every goal; both bounds are reached."""
    ratios = []
    for angle in np.linspace(0, np.pi, 181):
        goal = state(1.0 + np.cos(angle), 3.0 + 4 * np.sin(angle))
        dmp, qp = exact_deviations(ask(goal=goal), 2001)
        ratios.append(rms(dmp) / rms(qp))
    assert min(ratios) == pytest.approx(1.095, abs=1e-3)
    assert max(ratios) == pytest.approx(1.195, abs=1e-3)


@pytest.mark.parametrize(("goal", "ratio"), [(state(2.0, 3.0), 0.87), (state(1.0, 5.0), 0.79)])
def test_over_the_last_fifth_the_dmp_is_better(goal, ratio: float):
    """0.87 for a change of the final position alone, 0.79 of the final velocity alone."""
    dmp, qp = exact_deviations(ask(goal=goal), 2001)
    assert rms(dmp[1600:]) / rms(qp[1600:]) == pytest.approx(ratio, abs=0.01)
