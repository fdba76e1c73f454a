"""From wanted outgoing balls to postures and joint velocities of the arm, many at once."""

from dataclasses import dataclass, fields

import numpy as np

from robot.striking.arm import Arm
from robot.striking.contact import ContactLaw, better_normal, first_normal, racket_velocity

FIRST_ROUNDS, LAST_ROUNDS = 5, 4
"""Of the descent: to the normal of a heavy racket, then to that which the mobility asks for."""
NEARLY = 0.05
"""m and rad (of the unit normal); what the first descent leaves farther away is given up."""


class Rows:
    """A dataclass of arrays with the same first axis."""

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))  # pyright: ignore[reportArgumentType]

    def take(self, rows: np.ndarray):  # noqa: ANN201 - the subclass
        """Return the same with some of the rows."""
        return type(self)(*(getattr(self, field.name)[rows] for field in fields(self)))  # pyright: ignore[reportArgumentType]


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


def solve(arm: Arm, law: ContactLaw, shots: Shots) -> Hits:
    """Return the hits that were found; of the others nothing."""
    mass, wanted, incoming = arm.ball.mass, shots.wanted, shots.incoming
    rows = np.arange(len(shots))
    normals = first_normal(incoming, wanted)
    places = shots.positions - arm.offset * normals
    postures, _ = arm.descend(places, shots.sides[:, None] * normals, shots.seeds, FIRST_ROUNDS)
    position, normal = arm.chain.pose(postures)
    near = np.linalg.norm(position - places, axis=1) < NEARLY
    near &= np.linalg.norm(normal - shots.sides[:, None] * normals, axis=1) < NEARLY
    rows = rows[near]
    mobility = arm.mobility(postures[near])
    normals = better_normal(law, mass, mobility, incoming[rows], wanted[rows], normals[near])
    velocities = racket_velocity(law, mass, mobility, incoming[rows], wanted[rows], normals)
    places = shots.positions[rows] - arm.offset * normals + velocities * law.duration / 2
    sides = shots.sides[rows, None]
    postures, met = arm.descend(places, sides * normals, postures[near], LAST_ROUNDS)
    rows, postures, places, sides = rows[met], postures[met], places[met], sides[met]
    normals = sides * arm.chain.pose(postures)[1]
    mobility = arm.mobility(postures)
    velocities = racket_velocity(law, mass, mobility, incoming[rows], wanted[rows], normals)
    speeds = arm.velocities(postures, velocities)
    return Hits(rows, postures, speeds, places, normals, velocities, mobility)
