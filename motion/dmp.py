"""Dynamic movement primitives: the discrete one, and two with a moving goal for hitting (eq. 1–7).

All three are one system in real time t, with τ the duration in seconds, z = exp(−α_z t/τ), β = α/4:

    τ²ÿ = α(β(g − y) + τ(ġ − ẏ)) + τ²g̈ + η f(z)

They differ in the goal's motion g(t) and in the amplitude η:

| system       | g(t)                                                 | η         | from                        |
|--------------|------------------------------------------------------|-----------|-----------------------------|
| "discrete"   | p_f                                                  | p_f − p_0 | eq. 1–3                     |
| "linear"     | p_f − v_f(T − t)                                     | p_f − p_0 | Kober et al. 2010, ref. 15  |
| "polynomial" | quintic between both states, no acceleration at ends | 1         | Mülling et al. 2013, eq. 6–7 |

The linear one is written down from secondary sources.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from motion.errors import InvalidMotion
from motion.primitive import Primitive
from motion.request import Boundary
from motion.trajectory import Samples

System = Literal["discrete", "linear", "polynomial"]
Rule = Literal["euler", "trapezium"]

PHASE_DECAY = 4.0
"""α_z: the phase z ends at exp(−4); what the authors' code uses."""

GAIN = 25.0
"""α; β = α/4 makes the system critically damped. The authors' 50 doubles the error of the fit."""

BASIS_COUNT = 100
"""Basis functions: what the authors' code uses."""

LEAST_AMPLITUDE = 1e-9
"""A demonstration that ends this close (rad) to where it begins has no amplitude to divide by."""

SAMPLES = 1001
"""Of the demonstration, for the regression."""

WIDTH = 0.5
"""Standard deviation of a Gaussian in units of the distance to the next centre: locally weighted regression
follows the figures' demonstration best with it, to 1.2 rad/s² rms of 73."""


@dataclass(frozen=True, slots=True, eq=False)
class Dmp:
    """A learned system of J joints: the `weights` (J, N) of its forcing term."""

    system: System
    gain: float
    weights: np.ndarray

    def rollout(
        self, start: Boundary, goal: Boundary, duration: float, step: float = 0.001, rule: Rule = "euler"
    ) -> Samples:
        """The motion from `start` to about `goal` in `duration` s, sampled every `step` s, both ends included.

        Accelerations of start and goal are not looked at but for the start's with the rule "trapezium".
        """
        return integrate(self.drive(start, goal, duration, step), start, duration, self.gain, rule)

    def drive(self, start: Boundary, goal: Boundary, duration: float, step: float = 0.001) -> np.ndarray:
        """All of ÿ that does not depend on y and ẏ, every `step` s of the motion: (n, J), rad/s²."""
        s = np.linspace(0, 1, round(duration / step) + 1)
        forcing = forcing_rows(s, self.weights.shape[1]) @ self.weights.T * _amplitude(self.system, start, goal)
        g, dg, ddg = moving_goal(self.system, start, goal, duration, s)
        return ddg + (self.gain * (self.gain / 4 * g + duration * dg) + forcing) / duration**2


def integrate(drive: np.ndarray, start: Boundary, duration: float, gain: float, rule: Rule = "euler") -> Samples:
    """The motion from `start` under a drive (n, J) sampled from 0 to `duration`.

    "euler" is the paper's explicit rule. With "trapezium" samples are each other's integral by that rule, and
    the first one has the start's acceleration where that is not NaN.
    """
    stiffness, damping = gain**2 / 4 / duration**2, gain / duration
    h = duration / (len(drive) - 1)
    implicit = 1 + h * damping / 2 + h * h * stiffness / 4
    p, v = start.positions, start.velocities
    a = drive[0] - stiffness * p - damping * v
    if rule == "trapezium":
        a = np.where(np.isnan(start.accelerations), a, start.accelerations)
    out = np.empty((3, *drive.shape))
    out[:, 0] = p, v, a
    for k in range(1, len(drive)):
        if rule == "euler":
            p, v = p + h * v, v + h * a
        else:
            predicted = p + h * v / 2
            faster = (v + h / 2 * (a + drive[k] - stiffness * predicted)) / implicit
            p, v = predicted + h * faster / 2, faster
        a = drive[k] - stiffness * p - damping * v
        out[:, k] = p, v, a
    return Samples(out[0], out[1], out[2])


def learn_dmp(
    primitive: Primitive, system: System = "polynomial", basis_count: int = BASIS_COUNT, gain: float = GAIN
) -> Dmp:
    """Learn the forcing term from the demonstration that `primitive` was learned from, by eq. 2, 4 and 5.

    The goal moves as it would for the demonstration itself. Raises InvalidMotion where the amplitude of the
    demonstration, by which "discrete" and "linear" divide, is zero.
    """
    start, goal, duration = primitive.start, primitive.goal, primitive.duration
    amplitude = _amplitude(system, start, goal)
    if np.abs(amplitude).min() < LEAST_AMPLITUDE:
        joint = int(np.abs(amplitude).argmin())
        raise InvalidMotion("demonstration", f"ends where it begins on joint {joint}: a {system} DMP cannot learn it")
    s = np.linspace(0, 1, SAMPLES)
    shown = primitive.sample(s)
    g, dg, ddg = moving_goal(system, start, goal, duration, s)
    attraction = gain * (gain / 4 * (g - shown.positions) + duration * (dg - shown.velocities))
    target = duration**2 * (shown.accelerations - ddg) - attraction
    psi, z = _gaussians(s, basis_count), phase(s)[:, None]
    weights = (psi.T @ (z * target)) / (psi.T @ z**2) / amplitude
    return Dmp(system, gain, np.ascontiguousarray(weights.T))


def moving_goal(
    system: System, start: Boundary, goal: Boundary, duration: float, s: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration (n, J) of the goal at s (n,) = t/T."""
    s = np.asarray(s)[:, None]
    still = np.zeros((len(s), len(goal.positions)))
    if system == "discrete":
        return goal.positions + still, still, still
    if system == "linear":
        return goal.positions - goal.velocities * duration * (1 - s), goal.velocities + still, still
    return quintic(start, goal, duration, s)


def quintic(
    start: Boundary, goal: Boundary, duration: float, s: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The polynomial of eq. 7 at s (n, 1): from state to state, with zero acceleration at both ends."""
    travel = goal.positions - start.positions - duration * start.velocities
    gain = duration * (goal.velocities - start.velocities)
    c3, c4, c5 = 10 * travel - 4 * gain, 7 * gain - 15 * travel, 6 * travel - 3 * gain
    return (
        start.positions + duration * start.velocities * s + s**3 * (c3 + s * (c4 + s * c5)),
        start.velocities + s**2 * (3 * c3 + s * (4 * c4 + s * 5 * c5)) / duration,
        s * (6 * c3 + s * (12 * c4 + s * 20 * c5)) / duration**2,
    )


def phase(s: np.ndarray) -> np.ndarray:
    """z of the canonical system (eq. 1), from 1 to exp(−α_z), at s = t/τ."""
    return np.exp(-PHASE_DECAY * np.asarray(s))


def forcing_rows(s: np.ndarray, count: int) -> np.ndarray:
    """Rows (n, N) with which the weights make f(z)/η of eq. 3: normalised Gaussians times z."""
    psi = _gaussians(s, count)
    return psi / psi.sum(axis=1, keepdims=True) * phase(s)[:, None]


def _gaussians(s: np.ndarray, count: int) -> np.ndarray:
    """ψ_i(z) of eq. 3, (n, N): centres equally spaced in time, widths by the distance to the next."""
    centres = phase(np.linspace(0, 1, count))
    gaps = -np.diff(centres)
    sigma = WIDTH * np.append(gaps, gaps[-1])
    return np.exp(-(((phase(s)[:, None] - centres) / sigma) ** 2) / 2)


def _amplitude(system: System, start: Boundary, goal: Boundary) -> np.ndarray:
    return np.ones_like(goal.positions) if system == "polynomial" else goal.positions - start.positions
