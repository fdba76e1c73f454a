"""How far from the target a ball is expected to land."""

import numpy as np

from robot.striking.arm import Arm
from robot.striking.contact import ContactLaw
from robot.striking.flight import landing_gradient
from robot.striking.hits import Hits, Shots

RESTITUTION_STD, NORMAL_STD, RACKET_STD = 0.05, 0.01, 0.03
"""Standard deviations of e, of the racket's normal (rad, each way) and of its velocity (m/s, each way)."""


def landing_error(law: ContactLaw, arm: Arm, hits: Hits, shots: Shots) -> np.ndarray:
    """Return the root of the expected squared distances of the landing points from the target, (n,), m."""
    rows = hits.shots
    incoming, wanted, n = shots.incoming[rows], shots.wanted[rows], hits.normals
    mass = arm.ball.mass
    change = np.linalg.norm(wanted - incoming, axis=1)
    tilt = (np.eye(3) - n[:, :, None] * n[:, None, :]) * (NORMAL_STD * change)[:, None, None]
    pushed = np.linalg.solve(hits.mobility, n[:, :, None])[:, :, 0] * (1 + law.restitution) / mass
    by_restitution = pushed * (np.vecdot(hits.velocities - incoming, n) / (1 + law.restitution))[:, None]
    passed = np.eye(3) - pushed[:, :, None] * n[:, None, :]
    spread = tilt @ tilt + (RESTITUTION_STD**2 * by_restitution[:, :, None]) * by_restitution[:, None, :]
    spread = spread + RACKET_STD**2 * pushed[:, :, None] * pushed[:, None, :]
    spread = spread + passed @ shots.covariances[rows, 3:, 3:] @ passed.transpose(0, 2, 1)
    slope = landing_gradient(wanted, shots.arrivals[rows], shots.flights[rows])
    landed = slope @ spread @ slope.transpose(0, 2, 1) + shots.covariances[rows, :2, :2]
    return np.sqrt(np.trace(landed, axis1=1, axis2=2))
