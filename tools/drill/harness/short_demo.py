"""A short demonstration for scenarios that learn and forget."""

import math

from protocol import messages as m

NAME = "short_demo"
SECONDS = {200: 2.0, 300: 3.0}
"""The two versions: number of samples, and duration, s."""


def learn_request(samples: int, home: list[float]) -> m.Learn:
    """Return the request to learn one version, a small motion of joint_1, in place of the other."""
    positions = [[home[0] + 0.2 * math.sin(3.0 * k / samples), *home[1:]] for k in range(samples)]
    return m.Learn(name=NAME, positions=positions, rate=(samples - 1) / SECONDS[samples], replace=True)
