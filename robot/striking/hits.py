"""Postures and joint velocities of the arm for wanted outgoing velocities, for many balls at once."""

from dataclasses import dataclass

import numpy as np

from robot.striking.arm import Arm, Rows
from robot.striking.choice import Choice
from robot.striking.contact import ContactLaw, first_normal
from robot.striking.path import Path

FIRST_ROUNDS, LAST_ROUNDS = 5, 3
"""Iterations of the two descents: to the normal for a heavy racket, and to the normal for the actual mobility."""
FIRST_TOLERANCE = 0.05, 0.05
"""m and rad (of the unit normal), residuals of the first descent above which a candidate is dropped."""
TOLERANCE = 1e-3, 5e-3
"""m and rad, residuals of a converged descent; the racket's velocity compensates the residual of the normal."""
NORMAL_WEIGHT, CONTINUES_S, TOUCH_RADIUS = 0.01, 0.03, 0.7
"""Parameters of touches: weight of the normal, m a radian; s for which the velocities are kept; part of the racket's
radius within which the ball must meet it."""
TOUCH_SPEEDS = np.array([1.0, 0.7, 0.4, 0.0])
"""Parts of a swing's joint velocities that are tried for a touch."""


@dataclass(frozen=True, slots=True, eq=False)
class Shots(Rows):
    """n balls to be hit.

    times: s, of the touch. flights: s, to the target. ages: s, since the ball's last bounce, inf without one.
    positions, incoming: of the ball, (n, 3). covariances: (n, 6, 6). wanted, arrivals: velocities after the hit and at
    the target, (n, 3). sides: 1 for the front of the racket, −1 for its back. seeds: (n, J), initial postures of the
    search.
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
    """n states of the arm in the middle of a contact that give the balls their wanted velocities.

    shots: row of each hit in `Shots`. postures, joint_velocities: (n, J), rad, rad/s. positions, normals, velocities:
    of the racket, (n, 3), m, m/s; the normal points to the ball's side. mobility: (n, 3, 3), 1/kg.
    """

    shots: np.ndarray
    postures: np.ndarray
    joint_velocities: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    velocities: np.ndarray
    mobility: np.ndarray


def solve(arm: Arm, law: ContactLaw, shots: Shots, mobility: np.ndarray | None = None) -> Hits:
    """Return the hits that were found; shots without a hit are left out.

    mobility: (3, 3), 1/kg, of a similar hit, whose posture is the seed; None if unknown.
    """
    mass = arm.ball.mass
    normals = first_normal(shots.incoming, shots.wanted)
    rows, seeds = np.arange(len(shots)), shots.seeds
    if mobility is None:
        places, faces = shots.positions - arm.offset * normals, shots.sides[:, None] * normals
        first = arm.descend(places, faces, seeds, FIRST_ROUNDS)
        rows = np.flatnonzero(first.are_within(places, faces, *FIRST_TOLERANCE))
        first, normals = first.take(rows), normals[rows]
        seeds, mobilities = first.values, arm.mobility(first)
    else:
        mobilities = np.broadcast_to(mobility, (len(shots), 3, 3))
    incoming, wanted, sides = shots.incoming[rows], shots.wanted[rows], shots.sides[rows, None]
    normals = law.better_normal(mass, mobilities, incoming, wanted, normals)
    velocities = law.racket_velocity(mass, mobilities, incoming, wanted, normals)
    places = shots.positions[rows] - arm.offset * normals + velocities * law.duration / 2
    found = arm.descend(places, sides * normals, seeds, LAST_ROUNDS)
    met = np.flatnonzero(found.are_within(places, sides * normals, *TOLERANCE))
    found, rows = found.take(met), rows[met]
    normals, mobilities = sides[met] * found.normals, arm.mobility(found)
    velocities = law.racket_velocity(mass, mobilities, incoming[met], wanted[met], normals)
    speeds = arm.velocities(found, velocities)
    return Hits(rows, found.values, speeds, found.positions, normals, velocities, mobilities)


def choice_of(
    hits: Hits,
    shots: Shots,
    row: int,
    law: ContactLaw,
    target: np.ndarray,
    error: float,
    use: float,
    law_error: np.ndarray,
) -> Choice:
    """Return one of the hits as a Choice. law_error (3,), m/s: difference of a simulated contact from the law."""
    shot = int(hits.shots[row])
    time = float(shots.times[shot])
    return Choice(
        time=time,
        goal_time=time + law.duration / 2,
        positions=hits.postures[row],
        velocities=hits.joint_velocities[row],
        flight_time=float(shots.flights[shot]),
        target=np.asarray(target, dtype=float),
        ball=shots.positions[shot],
        incoming=shots.incoming[shot],
        outgoing=shots.wanted[shot] + law_error,
        law_error=law_error,
        racket_position=hits.positions[row],
        racket_normal=hits.normals[row],
        racket_velocity=hits.velocities[row],
        side=int(shots.sides[shot]),
        mobility=hits.mobility[row],
        error=error,
        use=use,
    )


def meets(arm: Arm, path: Path, choice: Choice) -> bool:
    """Return whether the ball meets the racket if a hit is played unchanged."""
    (place,), (velocity,) = path.at(np.array([choice.time]))
    moves, normal = velocity - choice.racket_velocity, choice.racket_normal
    offset = place - choice.racket_position - arm.offset * normal
    later = -(offset @ normal) / (moves @ normal)
    return bool(np.linalg.norm(offset + later * moves) < TOUCH_RADIUS * arm.racket.radius)


def touch(arm: Arm, law: ContactLaw, shots: Shots, last: Choice) -> Hits:
    """Return hits similar to `last`, moved to the balls, at several fractions of its speed, wherever the balls land.

    Joint velocities are limited to those from which a joint can stop inside its range.
    """
    places = shots.positions - arm.offset * last.racket_normal + last.racket_velocity * law.duration / 2
    faces = np.broadcast_to(last.side * last.racket_normal, places.shape)
    found = arm.descend(places, faces, shots.seeds, FIRST_ROUNDS, NORMAL_WEIGHT)
    met = np.linalg.norm(found.positions - places, axis=1) < TOUCH_RADIUS * arm.racket.radius
    rows = np.repeat(np.flatnonzero(met), len(TOUCH_SPEEDS))
    found, mobilities = found.take(rows), np.repeat(arm.mobility(found.take(met)), len(TOUCH_SPEEDS), axis=0)
    speeds = np.tile(TOUCH_SPEEDS, met.sum())[:, None] * last.velocities
    speeds = np.clip(speeds, *arm.stoppable(found.values, CONTINUES_S))
    velocities = (found.moves @ speeds[:, :, None])[:, :, 0]
    return Hits(rows, found.values, speeds, found.positions, last.side * found.normals, velocities, mobilities)
