"""Learn restitution, friction and bias of the contact law from the outgoing balls of hits."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from robot.striking.choice import Choice
from robot.striking.contact import ContactLaw
from robot.striking.flight import Air, Ball, travel

PRIOR_STD = np.array([0.1, 0.05, 0.15, 0.15, 0.15])
"""Prior standard deviations of restitution, friction, and the three components of the bias (m/s)."""

DRIFT_STD = np.array([0.003, 0.002, 0.003, 0.003, 0.003])
"""Standard deviations of their change from hit to hit."""

NOISE = 0.02
"""Standard deviation of an outgoing velocity from the law, as a part of the change of velocity."""

OUTLIER = 5.0
"""Standard deviations; balls farther from the prediction missed the strings and are not learned from."""

LOWEST, HIGHEST = np.array([-0.9, -1.0, -1.0, -1.0, -1.0]), np.array([1.5, 1.0, 1.0, 1.0, 1.0])


class LearningError(ValueError):
    """A file of a learned law cannot be read; `str()` is a sentence."""


@dataclass(slots=True, eq=False)
class Learner:
    """A Kalman filter of the contact law. law: current mean. covariance: (5, 5), of the quantities of `PRIOR_STD`."""

    law: ContactLaw
    covariance: np.ndarray
    hits: int = 0

    @staticmethod
    def of(law: ContactLaw) -> "Learner":
        """Return a learner with this law and the prior covariance."""
        return Learner(law, np.diag(PRIOR_STD**2))

    def observe(
        self,
        choice: Choice,
        ball_mass: float,
        outgoing: np.ndarray,
        std: float = 0.02,
        law_error: np.ndarray | None = None,
    ) -> bool:
        """Update with the outgoing velocity (3,), m/s, of the hit `choice`; return False for an outlier.

        std: of each component, m/s. law_error: (3,), m/s, difference of a simulated contact from the law.
        """
        law = self.law
        residual = outgoing - law.outgoing(ball_mass, *choice.contact)[0] - (0.0 if law_error is None else law_error)
        slope = law.derivatives(ball_mass, *choice.contact)[0]
        prior = self.covariance + np.diag(DRIFT_STD**2)
        unexplained = std**2 + (NOISE * float(np.linalg.norm(choice.outgoing - choice.incoming))) ** 2
        inner = slope @ prior @ slope.T + unexplained * np.eye(3)
        if not np.isfinite(residual).all() or residual @ np.linalg.solve(inner, residual) > OUTLIER**2:
            return False
        gain = np.linalg.solve(inner, slope @ prior).T
        self.covariance = prior - gain @ slope @ prior
        found = np.array([law.restitution, law.friction, *law.bias]) + gain @ residual
        found = np.clip(found, LOWEST, HIGHEST)
        self.law = ContactLaw(float(found[0]), float(found[1]), law.duration, found[2:])
        self.hits += 1
        return True


def outgoing_velocity(
    times: Sequence[float], positions: np.ndarray, hit: float, ball: Ball, air: Air
) -> tuple[np.ndarray, float] | None:
    """Return the velocity (3,) at the time `hit` of a ball later seen at positions (n, 3), and its std (m/s).

    Least squares over sights after the hit and before the next bounce; None with fewer than three sights.
    """
    if len(times) < 3:
        return None
    t = np.asarray(times, dtype=float) - hit
    velocity, place = np.zeros(3), np.zeros(3)
    rows = np.stack([np.ones_like(t), t], axis=1)
    for _ in range(3):
        expected, _ = travel(ball, air, np.tile(place, (len(t), 1)), np.tile(velocity, (len(t), 1)), t)
        change, *_ = np.linalg.lstsq(rows, positions - expected, rcond=None)
        place, velocity = place + change[0], velocity + change[1]
    expected, _ = travel(ball, air, np.tile(place, (len(t), 1)), np.tile(velocity, (len(t), 1)), t)
    residual = float(np.sqrt(np.sum((positions - expected) ** 2) / (3 * len(t) - 6 or 1)))
    return velocity, residual * float(np.sqrt(np.linalg.inv(rows.T @ rows)[1, 1]))


def write(path: Path, robot: str, learner: Learner) -> None:
    """Write the learned law of a robot as JSON; the file is replaced atomically."""
    law = learner.law
    found = {
        "robot": robot,
        "restitution": law.restitution,
        "friction": law.friction,
        "duration": law.duration,
        "bias": law.bias.tolist(),
        "covariance": learner.covariance.tolist(),
        "hits": learner.hits,
    }
    partial = path.with_suffix(path.suffix + ".part")
    # `json` with an indent makes a reference cycle, and the striker never collects garbage.
    partial.write_bytes(msgspec.json.format(msgspec.json.encode(found), indent=2) + b"\n")
    partial.replace(path)


def read(path: Path, robot: str) -> Learner | None:
    """Return the learned law of a robot, None if the file does not exist.

    Raises:
        LearningError: the file belongs to another robot, or is malformed.
    """
    try:
        text = path.read_text()
    except FileNotFoundError:
        return None
    try:
        found = json.loads(text)
        numbers = np.array([found["restitution"], found["friction"], *found["bias"]], dtype=float)
        covariance, duration = np.array(found["covariance"], dtype=float), float(found["duration"])
        hits, name = int(found["hits"]), found["robot"]
        sound = numbers.shape == (5,) and covariance.shape == (5, 5) and np.isfinite(covariance).all()
    except (ValueError, KeyError, TypeError) as error:
        raise LearningError(f"{path}: is not a learned contact law ({error}); delete it to learn again") from error
    if name != robot:
        raise LearningError(f"{path}: belongs to the robot {name!r}, not to {robot!r}; give each robot its own file")
    if not (sound and (numbers >= LOWEST).all() and (numbers <= HIGHEST).all() and 0 <= duration < 1):
        raise LearningError(f"{path}: holds values outside their ranges; delete it to learn again")
    return Learner(ContactLaw(numbers[0], numbers[1], duration, numbers[2:]), covariance, hits)
