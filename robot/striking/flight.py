"""How a ball flies and bounces, and with which velocity it must leave to land at a target.

The acceleration is g + wind − k|v|v + m ω × v. A simulation that integrates with semi-implicit Euler steps of δ moves a
ball by v t + a t (t + δ)/2 in the time t; δ = 0 is the continuous flight. See docs/striking.md.
"""

from dataclasses import dataclass, field

import numpy as np

GRAVITY = 9.81
"""m/s²."""

STEP_S = 0.01
"""Longest step of an integration; the acceleration is that of its middle."""

AIM_STEPS, AIM_ROUNDS = 12, 4
"""Steps of a flight to a target, and rounds of Newton's method, where drag or spin bend it."""


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball: mass (kg), radius (m), drag k (1/m), magnus m (1), and δ, the step (s) of the simulation it is in."""

    mass: float
    radius: float
    drag: float = 0.0
    magnus: float = 0.0
    step: float = 0.0


@dataclass(frozen=True, slots=True)
class Surface:
    """A horizontal surface: height of its top (m), and what a bounce does.

    restitution: of the vertical velocity. tangential: part of the horizontal velocity that is kept. dwell: s of
    contact. spread: standard deviation of the restitution from bounce to bounce.
    """

    height: float
    restitution: float
    tangential: float = 1.0
    dwell: float = 0.0
    spread: float = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Net:
    """A net: the middle of its top edge (3,), m, its horizontal normal (2,), half of its width (m)."""

    top: np.ndarray
    normal: np.ndarray
    half_width: float


@dataclass(frozen=True, slots=True)
class Court:
    """Where balls bounce and land. clearance: m above the net. bounces: the most that a ball makes before the hit."""

    surface: Surface
    net: Net | None = None
    clearance: float = 0.08
    bounces: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class Air:
    """What acts on the ball besides gravity: acceleration `wind` (3,), m/s², drag (1/m), spin (3,), rad/s."""

    drag: float = 0.0
    wind: np.ndarray = field(default_factory=lambda: np.zeros(3))
    spin: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def bends(self, ball: Ball) -> bool:
        """Return whether the acceleration depends on the velocity."""
        return bool(self.drag or (ball.magnus and self.spin.any()))


def acceleration(ball: Ball, air: Air, velocities: np.ndarray) -> np.ndarray:
    """Return the accelerations (…, 3), m/s², at velocities (…, 3)."""
    found = air.wind - [0.0, 0.0, GRAVITY]
    if air.drag:
        found = found - air.drag * np.linalg.norm(velocities, axis=-1, keepdims=True) * velocities
    if ball.magnus and air.spin.any():
        found = found + ball.magnus * np.cross(air.spin, velocities)
    return found


def middle_acceleration(ball: Ball, air: Air, velocities: np.ndarray, times: np.ndarray | float) -> np.ndarray:
    """Return the acceleration in the middle of a step of `times`, (…, 3)."""
    found = acceleration(ball, air, velocities)
    return acceleration(ball, air, velocities + found * np.asarray(times)[..., None] / 2) if air.bends(ball) else found


def fly(
    ball: Ball, air: Air, positions: np.ndarray, velocities: np.ndarray, times: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities (…, 3) after one step of `times` (…), without bounces."""
    a = middle_acceleration(ball, air, velocities, times)
    t = np.asarray(times)[..., None]
    return positions + velocities * t + a * (t * (t + ball.step) / 2), velocities + a * t


def travel(
    ball: Ball, air: Air, positions: np.ndarray, velocities: np.ndarray, times: np.ndarray, steps: int = AIM_STEPS
) -> tuple[np.ndarray, np.ndarray]:
    """Return what `fly` does, for long times (…), in several steps where the flight is bent."""
    if not air.bends(ball):
        return fly(ball, air, positions, velocities, times)
    for _ in range(steps):
        positions, velocities = fly(ball, air, positions, velocities, times / steps)
    return positions, velocities


def time_to_fall(heights: np.ndarray, speeds: np.ndarray, accelerations: np.ndarray, step: float) -> np.ndarray:
    """Return the times (…), s, in which a ball that is `heights` above the surface meets it; NaN where it does not.

    speeds, accelerations: vertical, upwards. A ball that is below the surface meets it at once if it sinks.
    """
    a, b, c = accelerations / 2, speeds + accelerations * step / 2, np.maximum(heights, 0.0)
    with np.errstate(invalid="ignore"):
        return -2 * c / (b - np.sqrt(b * b - 4 * a * c))


def aim(
    ball: Ball, air: Air, positions: np.ndarray, target: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocities (n, 3) with which balls at (n, 3) must leave to be at the target (3,) after times (n,).

    Also those with which they arrive.
    """
    t = times[:, None]
    velocities = (target - positions) / t - (air.wind - [0.0, 0.0, GRAVITY]) * ((t + ball.step) / 2)
    for _ in range(AIM_ROUNDS if air.bends(ball) else 0):
        reached, _ = travel(ball, air, positions, velocities, times)
        velocities = velocities + (target - reached) / t
    return velocities, travel(ball, air, positions, velocities, times)[1]


def landing_gradient(velocities: np.ndarray, arrivals: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return by how much landing points move with the velocity a ball leaves with, (n, 2, 3), s; drag left out."""
    found = np.zeros((len(times), 2, 3))
    found[:, 0, 0] = found[:, 1, 1] = times
    found[:, :, 2] = times[:, None] * arrivals[:, :2] / np.maximum(-arrivals[:, 2], 0.1)[:, None]
    return found


def above_net(
    ball: Ball, air: Air, net: Net, positions: np.ndarray, velocities: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """Return how far (n,), m, the ball's lower edge passes above the net; inf where it does not cross it in `times`."""
    normal = net.normal / np.linalg.norm(net.normal)
    before = (positions[:, :2] - net.top[:2]) @ normal
    after = (travel(ball, air, positions, velocities, times)[0][:, :2] - net.top[:2]) @ normal
    low, high = np.zeros(len(times)), times.astype(float)
    crosses = before * after < 0
    crossing = np.where(crosses, times * before / np.where(crosses, before - after, 1.0), times)
    for _ in range(6 if air.bends(ball) else 2):
        place, _ = travel(ball, air, positions, velocities, crossing)
        now = (place[:, :2] - net.top[:2]) @ normal
        same = now * before > 0
        low, high = np.where(same, crossing, low), np.where(same, high, crossing)
        speed = (after - before) / times
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = np.clip(np.where(crosses, crossing - now / speed, times), low, high)
    place, _ = travel(ball, air, positions, velocities, crossing)
    beside = np.abs((place[:, :2] - net.top[:2]) @ [-normal[1], normal[0]]) > net.half_width + ball.radius
    return np.where(crosses & ~beside, place[:, 2] - ball.radius - net.top[2], np.inf)
