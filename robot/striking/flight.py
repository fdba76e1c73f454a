"""Flight and bounces of a ball, and the velocities that make it land at a target.

The acceleration is g + wind − k|v|v + m ω × v. A simulation that integrates with semi-implicit Euler steps of δ moves a
ball by v t + a t (t + δ)/2 in the time t; δ = 0 is the continuous flight. See docs/striking.md.
"""

from dataclasses import dataclass, field

import numpy as np

GRAVITY = 9.81
"""m/s²."""

AIM_STEPS, AIM_ROUNDS = 2, 2
"""Integration steps of a flight to a target, and Newton iterations, with drag or spin."""
CROSSING_ROUNDS = 4
"""Newton iterations for the point at which a flight crosses the net."""


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball: mass (kg), radius (m), drag k (1/m), magnus m (1), and δ, the step (s) of its simulation."""

    mass: float
    radius: float
    drag: float = 0.0
    magnus: float = 0.0
    step: float = 0.0


@dataclass(frozen=True, slots=True)
class Surface:
    """A horizontal surface: height of its top (m), and its bounce.

    restitution: of the vertical velocity. tangential: part of the horizontal velocity that is kept. dwell: s of
    contact. spread: standard deviation of the restitution between bounces.
    """

    height: float
    restitution: float
    tangential: float = 1.0
    dwell: float = 0.0
    spread: float = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Net:
    """A net: the centre of its top edge (3,), m, its horizontal normal (2,), half of its width (m)."""

    top: np.ndarray
    normal: np.ndarray
    half_width: float


@dataclass(frozen=True, slots=True)
class Court:
    """Where balls bounce and land. clearance: m above the net. bounces: maximum number before the hit."""

    surface: Surface
    net: Net | None = None
    clearance: float = 0.08
    bounces: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class Air:
    """Forces on the ball besides gravity: acceleration `wind` (3,), m/s², drag (1/m), spin (3,), rad/s.

    constant: (3,), m/s², the part that does not depend on the velocity. spins: whether there is spin.
    """

    drag: float = 0.0
    wind: np.ndarray = field(default_factory=lambda: np.zeros(3))
    spin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    constant: np.ndarray = field(init=False)
    spins: bool = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "constant", self.wind - [0.0, 0.0, GRAVITY])
        object.__setattr__(self, "spins", bool(self.spin.any()))

    def depends_on_velocity(self, ball: Ball) -> bool:
        """Return whether the acceleration depends on the velocity."""
        return bool(self.drag or (ball.magnus and self.spins))


def acceleration(ball: Ball, air: Air, velocities: np.ndarray) -> np.ndarray:
    """Return the accelerations (…, 3), m/s², at velocities (…, 3)."""
    found = air.constant
    if air.drag:
        speeds = np.sqrt(np.vecdot(velocities, velocities))
        found = found - (air.drag * speeds)[..., None] * velocities
    if ball.magnus and air.spins:
        found = found + ball.magnus * np.cross(air.spin, velocities)
    return found


def fly(
    ball: Ball, air: Air, positions: np.ndarray, velocities: np.ndarray, times: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities (…, 3) after `times` (…), without bounces, by one Runge–Kutta step.

    Exact if the acceleration does not depend on the velocity.
    """
    t = np.asarray(times)[..., None]
    first = acceleration(ball, air, velocities)
    if not air.depends_on_velocity(ball):
        return positions + velocities * t + first * (t * (t + ball.step) / 2), velocities + first * t
    second = acceleration(ball, air, velocities + first * (t / 2))
    third = acceleration(ball, air, velocities + second * (t / 2))
    fourth = acceleration(ball, air, velocities + third * t)
    middle = second + third
    gained = (first + 2 * middle + fourth) * (t / 6)
    moved = velocities * t + (first + middle) * (t * t / 6) + gained * (ball.step / 2)
    return positions + moved, velocities + gained


def travel(
    ball: Ball, air: Air, positions: np.ndarray, velocities: np.ndarray, times: np.ndarray, steps: int = AIM_STEPS
) -> tuple[np.ndarray, np.ndarray]:
    """Return the same as `fly` for long times (…), in several steps if the acceleration depends on the velocity."""
    steps = steps if air.depends_on_velocity(ball) else 1
    for _ in range(steps):
        positions, velocities = fly(ball, air, positions, velocities, times / steps)
    return positions, velocities


def time_to_fall(
    heights: np.ndarray | float, speeds: np.ndarray | float, accelerations: np.ndarray | float, step: float
) -> np.ndarray:
    """Return the times (…), s, until a ball that is `heights` above the surface meets it; NaN if it does not.

    speeds, accelerations: vertical, upwards. A ball below the surface meets it at once if it moves down.
    """
    a, b, c = accelerations / 2, speeds + accelerations * step / 2, np.maximum(heights, 0.0)
    with np.errstate(invalid="ignore"):
        return -2 * c / (b - np.sqrt(b * b - 4 * a * c))


def aim(
    ball: Ball,
    air: Air,
    positions: np.ndarray,
    target: np.ndarray,
    times: np.ndarray,
    incoming: np.ndarray | float = 0.0,
    contact: float = 0.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the outgoing velocities (n, 3) that bring balls to the target (3,) after times (n,).

    Also their initial positions, and their velocities at the target. The initial positions are `positions` (n, 3) moved
    by the mean of `incoming` (n, 3) and outgoing velocity during a contact of `contact` (s).
    """
    t, half = times[:, None], contact / 2
    leaves = positions + incoming * half
    velocities = ((target - leaves) / t - air.constant * ((t + ball.step) / 2)) / (1 - half / t)
    if not air.depends_on_velocity(ball):
        return velocities, leaves - velocities * half, velocities + air.constant * t
    arrivals = velocities
    for _ in range(AIM_ROUNDS):
        reached, arrivals = travel(ball, air, leaves - velocities * half, velocities, times)
        # Derivative of positions by velocities, with drag linearised.
        slowed = 1.5 * air.drag * np.sqrt(np.vecdot(velocities, velocities))[:, None] * t + 1e-9
        change = (target - reached) / (-np.expm1(-slowed) / slowed * t - half)
        velocities, arrivals = velocities + change, arrivals + change
    return velocities, leaves - velocities * half, arrivals


def landing_gradient(velocities: np.ndarray, arrivals: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the derivatives of landing points by the outgoing velocity, (n, 2, 3), s, without drag."""
    found = np.zeros((len(times), 2, 3))
    found[:, 0, 0] = found[:, 1, 1] = times
    found[:, :, 2] = times[:, None] * arrivals[:, :2] / np.maximum(-arrivals[:, 2], 0.1)[:, None]
    return found


def net_clearance(
    ball: Ball, air: Air, net: Net, positions: np.ndarray, velocities: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """Return the distances (n,), m, of the ball's lower edge above the net; inf if it does not cross it in `times`."""
    normal = net.normal / np.linalg.norm(net.normal)
    steps = AIM_STEPS if air.depends_on_velocity(ball) else 1
    width = times[:, None] / steps
    states = [(positions, velocities)]
    for _ in range(steps):
        states.append(fly(ball, air, *states[-1], times / steps))
    # Across the net, along it, and up, between the steps.
    axes = np.array([[*normal, 0.0], [-normal[1], normal[0], 0.0], [0.0, 0.0, 1.0]]).T
    places = np.stack([(place - net.top) @ axes for place, _ in states])
    sides = places[:, :, 0] > 0
    crosses = sides[:-1] != sides[1:]
    rows, step = np.arange(len(times)), crosses.argmax(axis=0)
    moves = np.stack([speed @ axes * width for _, speed in states])
    cubic = Cubic(places[step, rows], places[step + 1, rows], moves[step, rows], moves[step + 1, rows])
    before, after = places[step, rows, 0], places[step + 1, rows, 0]
    found = crosses.any(axis=0)
    u = np.where(found, before / np.where(found, before - after, 1.0), 0.0)
    for _ in range(CROSSING_ROUNDS):
        now, slope = cubic.at(u)[:, 0], cubic.slope(u)[:, 0]
        u = np.minimum(np.maximum(u - now / np.where(np.abs(slope) > 1e-9, slope, 1.0), 0.0), 1.0)
    _, along, up = cubic.at(u).T
    return np.where(found & (np.abs(along) <= net.half_width + ball.radius), up - ball.radius, np.inf)


class Cubic:
    """Cubics (n, 3) in u from 0 to 1 between positions (n, 3), with derivatives `move` and `last_move` at the ends."""

    def __init__(self, first: np.ndarray, last: np.ndarray, move: np.ndarray, last_move: np.ndarray) -> None:
        self.place, self.move, way = first, move, last - first
        self.second = 3 * way - 2 * move - last_move
        self.third = move + last_move - 2 * way

    def at(self, u: np.ndarray) -> np.ndarray:
        """Return the positions (n, 3) at u (n,)."""
        u = u[:, None]
        return self.place + u * (self.move + u * (self.second + u * self.third))

    def slope(self, u: np.ndarray) -> np.ndarray:
        """Return the derivatives (n, 3) at u (n,)."""
        u = u[:, None]
        return self.move + u * (2 * self.second + 3 * u * self.third)
