"""The quadratic program of the paper, eq. 8–17, of each joint: Gaussian weights, limits at 1001 instants.

In normalised time s the weights w are those of g″(s), rad. Three slips of the text are corrected: the linear term of
eq. 16 is −2τ²θᵀw, τ is T_d/T, and θ scales with the duration as Ψ does (here neither depends on it).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import simpson

from motion.errors import InvalidMotion
from motion.gaussian_basis import make_basis
from motion.primitive import Primitive
from motion.program.equalities import Fixed, fixed_inside
from motion.program.terminal_set import final_accelerations
from motion.request import MotionRequest

INSTANTS = np.linspace(0, 1, 1001)
FINE = np.linspace(0, 1, 4001)
"""Instants in s at which the demonstration is sampled for θ."""

SAME = 1e-9
"""Instants closer than this in s are treated as one."""


@dataclass(frozen=True, slots=True, eq=False)
class GaussianProgram:
    """Minimise ½wᵀPw + cᵀw subject to Aw = b and low ≤ Gw ≤ high: eq. 16 and 17 of one joint.

    P = 2Ψ (N, N), c = −2θ (N,). A (m, N), b (m,): the values that the request prescribes, except the start's position
    and velocity. G (r, N), low, high (r,): limits at INSTANTS, without those that the equalities determine. quantity, s
    (r,): for each row of G, the derivative of the position (0 to 3) and the instant. start: position (rad) and velocity
    with respect to s.
    """

    P: np.ndarray
    c: np.ndarray
    A: np.ndarray
    b: np.ndarray
    G: np.ndarray
    low: np.ndarray
    high: np.ndarray
    quantity: np.ndarray
    s: np.ndarray
    start: tuple[float, float]


def make_programs(
    primitive: Primitive, request: MotionRequest, basis_count: int, margin: float = 0.0
) -> list[GaussianProgram]:
    """Return the program of each joint.

    margin: safety margin inside the limits (section IV-B), as a part of half their range; it is reduced where a
    prescribed value lies in it.

    Raises:
        InvalidMotion: a place time, which this cost does not have, or more prescribed values than functions.
        LimitExceeded: a prescribed value outside its limits.
        CannotStop: no stop after the goal keeps the limits.
    """
    if request.place_time is not None:
        raise InvalidMotion("place_time", f"is {request.place_time}; the paper's cost has no place term; use 'qp'")
    request, fixed = fixed_inside(request)
    # Unlike `motion.plan`, this method accepts no start outside the limits.
    if error := request.limits.exceeded(np.zeros(1, dtype=int), request.start.positions[None]):
        raise error
    powers = request.moving_duration ** np.arange(4.0)
    bounds = _bounds(request, fixed, margin) * powers[:, None, None]
    values = fixed.values * powers[fixed.quantity, None]
    theta = _theta(primitive, request, basis_count)
    return [_program(fixed, values[:, joint], bounds[joint], theta[:, joint]) for joint in range(request.joint_count)]


def _bounds(request: MotionRequest, fixed: Fixed, margin: float) -> np.ndarray:
    """Lowest and highest values (J, 4, 1001, 2) of all quantities at all instants, in physical units."""
    low, high = request.limits.ranges.transpose(2, 0, 1).copy()
    width = high - low
    inside = margin / 2 * np.where(np.isfinite(width), width, 0.0)
    least, most = low + inside, high - inside
    for quantity in range(3):
        values = fixed.values[fixed.quantity == quantity]
        least[:, quantity] = np.fmin.reduce([least[:, quantity], *values])
        most[:, quantity] = np.fmax.reduce([most[:, quantity], *values])
    low, high = np.maximum(low, least), np.minimum(high, most)
    bounds = np.repeat(np.stack([low, high], axis=2)[:, :, None], len(INSTANTS), axis=2)
    if request.tail == "stop":
        bounds[:, 2, -1] = final_accelerations(request)
    return bounds


def _theta(primitive: Primitive, request: MotionRequest, basis_count: int) -> np.ndarray:
    """θ (N, J): ∫ψd″ of the imitated part, in its own normalised time."""
    begin, end = request.imitates
    shown = primitive.sample(begin + (end - begin) * FINE).accelerations
    target = ((end - begin) * primitive.duration) ** 2 * shown
    psi = make_basis(basis_count).rows(FINE, 0)
    return np.asarray(simpson(psi[:, :, None] * target[:, None], x=FINE, axis=0))


def _program(fixed: Fixed, values: np.ndarray, bounds: np.ndarray, theta: np.ndarray) -> GaussianProgram:
    """The program of one joint from its prescribed values (F,) and its bounds (4, 1001, 2) in normalised time."""
    count = len(theta)
    basis = make_basis(count)
    given = ~np.isnan(values)
    decided = np.zeros(bounds.shape[:2], dtype=bool)
    for quantity, s in zip(fixed.quantity[given], fixed.s[given], strict=True):
        decided[quantity] |= np.abs(INSTANTS - s) < SAME
    given[:2] = False
    if given.sum() > count:
        raise InvalidMotion("waypoints", f"fix {given.sum()} values of a joint; at most {count} can be met")
    place, speed = values[:2].tolist()
    quantity, s = fixed.quantity[given], fixed.s[given]
    equal = [basis.rows(np.array([at]), k - 2) for k, at in zip(quantity, s, strict=True)]
    limited = np.isfinite(bounds).any(axis=2) & ~decided
    offsets = np.zeros(bounds.shape[:2])
    offsets[0], offsets[1] = place + speed * INSTANTS, speed
    low, high = ((bounds[..., side] - offsets)[limited] for side in (0, 1))
    target = values[given] - np.where(quantity == 0, place + speed * s, np.where(quantity == 1, speed, 0.0))
    which, when = np.nonzero(limited)
    return GaussianProgram(
        P=2 * basis.gram(),
        c=-2 * theta,
        A=np.concatenate(equal) if equal else np.zeros((0, count)),
        b=target,
        G=rows(count)[limited],
        low=low,
        high=high,
        quantity=which,
        s=INSTANTS[when],
        start=(place, speed),
    )


@cache
def rows(basis_count: int) -> np.ndarray:
    """Rows (4, 1001, N) of position, velocity, acceleration and jerk at INSTANTS, without the start's contribution."""
    basis = make_basis(basis_count)
    return np.array([basis.rows(INSTANTS, order) for order in range(-2, 2)])
