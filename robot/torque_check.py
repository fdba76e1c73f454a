"""Check motions for torques beyond the arm's limits."""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from motion.errors import MotionError, works_in
from motion.trajectory import Samples, Trajectory
from robot.description import RobotConfig
from robot.torques import InverseDynamics

COARSE = 16
"""Torques are computed at every 16th step, and interpolated in between from accelerations and inertias."""

NEAR_LIMIT = 0.85
"""Fraction of a torque limit above which torques are computed at every step and half-way to the next."""

ROUNDING = 1e-9


@dataclass(eq=False)
class TorqueExceeded(MotionError):
    """A motion exceeds a joint's torque limit.

    `time` (s from the start) is the first instant beyond `bound`, `value` (N·m, signed) the largest found in the second
    around it. `min_duration` (s) is a duration in which the motion can be played, `waypoint_times` (s) are its
    waypoints' times in it; both are None if none was found or tried, and the sentence then gives the advice
    `otherwise`.
    """

    joint: int
    value: float
    bound: float
    time: float
    min_duration: float | None = None
    waypoint_times: list[float] | None = None
    otherwise: str = "allow more time, or change the goal"
    quantity: str = field(init=False, default="torque")

    def __str__(self) -> str:
        remedy = works_in(self.min_duration, self.waypoint_times, self.otherwise)
        return (
            f"joint {self.joint}: needs a torque of {abs(self.value):.4g} N·m, first more than its "
            f"{abs(self.bound):.4g} N·m at {self.time:.3f} s; {remedy}"
        )


class TorqueCheck:
    """Compares the torques of motions with the arm's limits. Not thread-safe: use one a thread."""

    def __init__(self, config: RobotConfig, model: mujoco.MjModel) -> None:
        self._dynamics = InverseDynamics(config, model)
        self._limits = config.torques
        # Friction jumps when a velocity changes sign, so torques between two steps cannot be interpolated.
        self._near = NEAR_LIMIT * self._limits - 2 * self._dynamics.friction
        self.unused = np.where(np.isfinite(self._limits), 0.0, np.nan)

    def use(self, trajectory: Trajectory, times: np.ndarray, states: Samples) -> np.ndarray:
        """Return the largest used fraction of each joint's torque limit, (J,); NaN for a joint without a limit.

        times: (n,), s, at even steps, with n - 1 a multiple of `COARSE`; states: the trajectory's states at these.

        Raises:
            TorqueExceeded: a joint exceeds its torque limit.
        """
        torques = self._along(states)
        # A jerky motion can exceed a limit between two steps.
        near = times[(np.abs(torques) > self._near).any(axis=1)]
        if near.size:
            half = (times[1] - times[0]) / 2
            halfway = np.unique(np.maximum([near - half, near + half], times[0]))
            times = np.concatenate([times, halfway])
            inner = trajectory.sample(halfway)
            torques = np.concatenate([torques, [self._at(inner, row) for row in range(len(halfway))]])
            order = np.argsort(times, kind="stable")
            times, torques = times[order], torques[order]
        used = np.abs(torques) / self._limits
        beyond = np.flatnonzero((used > 1 + ROUNDING).any(axis=1))
        if beyond.size:
            joint = int(used[beyond[0]].argmax())
            sign = float(np.sign(torques[beyond[0], joint]))
            value = sign * float((sign * torques[:, joint]).max())
            raise TorqueExceeded(joint, value, sign * float(self._limits[joint]), float(times[beyond[0]]))
        return self.unused + used.max(axis=0)

    def _along(self, states: Samples) -> np.ndarray:
        """Return the torques at the states, (n, J)."""
        coarse, inertias = [], []
        for step in range(0, len(states), COARSE):
            coarse.append(self._at(states, step))
            inertias.append(self._dynamics.inertia())
        torques = between(np.array(coarse), np.array(inertias), states.accelerations)
        for step in np.flatnonzero((np.abs(torques) > self._near).any(axis=1)).tolist():
            torques[step] = self._at(states, step)
        return torques

    def _at(self, states: Samples, step: int) -> np.ndarray:
        return self._dynamics.torques(states.positions[step], states.velocities[step], states.accelerations[step])


def between(torques: np.ndarray, inertias: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
    """Return the torques at all steps from those at every `COARSE`-th.

    Inertia and the remaining torque (gravity, Coriolis, friction) are interpolated linearly; accelerations are those
    of each step. torques: (k, J), N·m. inertias: (k, J, J), kg·m². accelerations: (n, J),
    rad/s². Returns ((k - 1)·COARSE + 1, J).
    """
    joints = torques.shape[1]
    known = accelerations[: (len(torques) - 1) * COARSE + 1]
    rest = torques - np.matmul(inertias, known[::COARSE, :, None])[..., 0]
    inner = known[:-1].reshape(-1, COARSE, joints)
    before, after = (np.matmul(inner, inertias[part]) + rest[part, None] for part in (slice(-1), slice(1, None)))
    share = np.linspace(0, 1, COARSE, endpoint=False)[:, None]
    found = before + share * (after - before)
    return np.concatenate([found.reshape(-1, joints), torques[-1:]])
