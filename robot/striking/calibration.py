"""Calibrate the contact law of a robot by simulated hits."""

from dataclasses import dataclass

import numpy as np

from robot.striking.arm import Arm
from robot.striking.choice import Choice
from robot.striking.contact import ContactLaw
from robot.striking.reachability import Reachability
from robot.striking.simulated_contact import SimulatedContact

HITS = 300
CLOSING = (2.0, 8.0)
"""Range of the closing speed of ball and racket, m/s."""
SLANT = 0.5
"""Largest tangential speed as a part of the closing speed."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A contact law, the number of hits, and the rms residual (m/s) of their outgoing velocities."""

    law: ContactLaw
    hits: int
    rms: float


def calibrate(arm: Arm, reachability: Reachability, contact: SimulatedContact, hits: int = HITS) -> Calibration:
    """Fit a law to simulated hits in random postures of the table, with random velocities from a fixed seed.

    Raises:
        ValueError: fewer than ten hits touched the ball.
    """
    rng = np.random.default_rng(0)
    rows, differences, durations, cases = [], [], [], []
    plain = ContactLaw(0.0, 0.0)
    for index in rng.integers(len(reachability.postures), size=hits):
        choice = _hit(arm, reachability.postures[index], rng)
        touch = contact.hit(choice, float(rng.uniform()))
        if touch is None:
            continue
        rows.append(plain.derivatives(arm.ball.mass, *choice.contact)[0, :, :2])
        differences.append(touch.velocity - plain.outgoing(arm.ball.mass, *choice.contact)[0])
        durations.append(touch.duration)
        cases.append(choice)
    if len(rows) < 10:
        raise ValueError(
            f"only {len(rows)} of {hits} simulated hits met the ball; check the racket's size and its tool site"
        )
    slope, value = np.concatenate(rows), np.concatenate(differences)
    found = np.zeros(2)
    for _ in range(2):  # The second fit leaves out hits that met something other than the strings.
        found = np.linalg.lstsq(slope, value, rcond=None)[0]
        missed = np.linalg.norm((value - slope @ found).reshape(-1, 3), axis=1)
        good = np.repeat(missed < 4 * np.median(missed), 3)
        slope, value = slope[good], value[good]
    rms = float(np.sqrt(np.mean((value - slope @ found) ** 2) * 3))
    e, kappa = found.tolist()
    return Calibration(ContactLaw(e, kappa, float(np.median(durations))), len(value) // 3, rms)


def _hit(arm: Arm, posture: np.ndarray, rng: np.random.Generator) -> Choice:
    here = arm.postures(posture[None])
    position, axis = here.positions[0], here.normals[0]
    side = -1 if arm.racket.two_sided and rng.uniform() < 0.5 else 1
    normal = side * axis
    closing = rng.uniform(*CLOSING)
    across = rng.normal(size=3)
    across -= across @ normal * normal
    across *= rng.uniform(0, SLANT) * closing / np.linalg.norm(across)
    racket = rng.uniform(0.1, 0.6) * closing * normal
    speeds = arm.velocities(here, racket[None])[0]
    racket = here.moves[0] @ speeds
    incoming = racket - closing * normal + across
    place, zero = position + arm.offset * normal, np.zeros(3)
    mobility = arm.mobility(here)[0]
    return Choice(
        *(0.0, 0.0, posture, speeds, 1.0, zero, place, incoming, zero, zero),
        *(position, normal, racket, side, mobility, 0.0, 0.0),
    )
