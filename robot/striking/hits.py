"""From wanted outgoing balls to postures and joint velocities of the arm, many at once."""

from dataclasses import dataclass

import numpy as np

from robot.striking.arm import Arm, Rows
from robot.striking.contact import ContactLaw, better_normal, first_normal, racket_velocity

FIRST_ROUNDS, LAST_ROUNDS = 5, 3
"""Of the descent: to the normal of a heavy racket, then to that which the mobility asks for."""
NEARLY = 0.05, 0.05
"""m and rad (of the unit normal); what the first descent leaves farther away is given up."""
MET = 1e-3, 5e-3
"""m and rad, within which a descent has arrived; the racket's velocity makes up for what is left of the normal."""


@dataclass(frozen=True, slots=True, eq=False)
class Shots(Rows):
    """n balls to be hit.

    times: s, of the touch. flights: s, to the target. ages: s, since the ball's last bounce, inf without one.
    positions, incoming: of the ball, (n, 3). covariances: (n, 6, 6). wanted, arrivals: velocities after the hit and at
    the target, (n, 3). sides: 1 for the front of the racket, −1 for its back. seeds: (n, J), postures to search from.
    """

    times: np.ndarray
    flights: np.ndarray
    ages: np.ndarray
    positions: np.ndarray
    incoming: np.ndarray
    covariances: np.ndarray
    wanted: np.ndarray
    arrivals: np.ndarray
    sides: np.ndarray
    seeds: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Hits(Rows):
    """n states of the arm in the middle of a contact that send balls off as wanted.

    shots: their rows. postures, speeds: (n, J). places, normals, velocities: of the racket, (n, 3), the normal on the
    ball's side. mobility: (n, 3, 3).
    """

    shots: np.ndarray
    postures: np.ndarray
    speeds: np.ndarray
    places: np.ndarray
    normals: np.ndarray
    velocities: np.ndarray
    mobility: np.ndarray


def solve(arm: Arm, law: ContactLaw, shots: Shots, mobility: np.ndarray | None = None) -> Hits:
    """Return the hits that were found; of the others nothing.

    mobility: (3, 3), 1/kg, of a hit like these, in whose posture the search begins; None: not known.
    """
    mass = arm.ball.mass
    normals = first_normal(shots.incoming, shots.wanted)
    rows, seeds = np.arange(len(shots)), shots.seeds
    if mobility is None:
        places, faces = shots.positions - arm.offset * normals, shots.sides[:, None] * normals
        first = arm.descend(places, faces, seeds, FIRST_ROUNDS)
        rows = np.flatnonzero(first.are_within(places, faces, *NEARLY))
        first, normals = first.take(rows), normals[rows]
        seeds, mobilities = first.values, arm.mobility(first)
    else:
        mobilities = np.broadcast_to(mobility, (len(shots), 3, 3))
    incoming, wanted, sides = shots.incoming[rows], shots.wanted[rows], shots.sides[rows, None]
    normals = better_normal(law, mass, mobilities, incoming, wanted, normals)
    velocities = racket_velocity(law, mass, mobilities, incoming, wanted, normals)
    places = shots.positions[rows] - arm.offset * normals + velocities * law.duration / 2
    found = arm.descend(places, sides * normals, seeds, LAST_ROUNDS)
    met = np.flatnonzero(found.are_within(places, sides * normals, *MET))
    found, rows = found.take(met), rows[met]
    normals, mobilities = sides[met] * found.normals, arm.mobility(found)
    velocities = racket_velocity(law, mass, mobilities, incoming[met], wanted[met], normals)
    speeds = arm.velocities(found, velocities)
    return Hits(rows, found.values, speeds, found.positions, normals, velocities, mobilities)
