"""Expected landing error of a hit, and the expected cost of its corrections."""

import numpy as np

from robot.striking.arm import Arm
from robot.striking.contact import ContactLaw
from robot.striking.flight import landing_gradient
from robot.striking.hits import Hits, Shots
from robot.striking.options import Options

RESTITUTION_STD, NORMAL_STD, RACKET_STD = 0.05, 0.01, 0.03
"""Standard deviations of e, of the racket's normal (rad, each axis) and of its velocity (m/s, each axis)."""


def landing_error(
    law: ContactLaw, arm: Arm, hits: Hits, shots: Shots, law_error: np.ndarray | None = None
) -> np.ndarray:
    """Return the rms expected distances of the landing points from the target, (n,), m.

    law_error: (n, 3), m/s, differences of the law's outgoing velocities from the wanted ones; None for zero.
    """
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
    if law_error is not None:
        spread = spread + law_error[:, :, None] * law_error[:, None, :]
    spread = spread + passed @ shots.covariances[rows, 3:, 3:] @ passed.transpose(0, 2, 1)
    slope = landing_gradient(wanted, shots.arrivals[rows], shots.flights[rows])
    landed = slope @ spread @ slope.transpose(0, 2, 1) + shots.covariances[rows, :2, :2]
    return np.sqrt(np.trace(landed, axis1=1, axis2=2))


def correction_cost(arm: Arm, options: Options, hits: Hits, shots: Shots, use: np.ndarray) -> np.ndarray:
    """Return the expected cost (n,), m, of later corrections of a hit.

    It grows with the uncertainty of the ball's position, times: how soon after a bounce the hit is, how much of the
    limits it uses, and how near the end of a joint's range it is. use: (n,), largest part of a limit that each hit
    uses.
    """
    spread = np.sqrt(np.trace(shots.covariances[hits.shots, :3, :3], axis1=1, axis2=2))
    early = np.clip(1 - shots.ages[hits.shots] / options.settling_time, 0, 1)
    low, high = arm.limits.positions.T
    room = np.minimum(hits.postures - low, high - hits.postures).min(axis=1)
    edge = np.clip(1 - room / (options.edge_room * spread), 0, 1)
    return spread * (options.early_cost * early + options.use_cost * use + options.edge_cost * edge)
