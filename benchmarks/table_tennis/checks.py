"""What was played against the limits: the plan at 10 kHz, and the environment's arm at every step of its physics."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.table_tennis.played import Motion
from motion.limits import Limits
from motion.trajectory import COEFFICIENTS, Trajectory

CHECK_HZ = 10_000
SLACK = 1e-6
"""Of rounding: rad of a position, and a part of the other limits."""
JOINTS = 7


def violations(limits: Limits, motions: list[Motion], until: float) -> int:
    """Return at how many of 10,000 instants a second what was played passes a limit, on any joint, and seams jump.

    Nothing of the planner's is used: the pieces' powers are evaluated here, derivatives are those of the powers.
    """
    count = 0
    last: np.ndarray | None = None
    bounds = [limits.positions[:, 1], limits.velocities, limits.accelerations, limits.jerks]
    for k, motion in enumerate(motions):
        end = motions[k + 1].start if k + 1 < len(motions) else until
        times = np.arange(motion.start, end, 1 / CHECK_HZ) - motion.start
        values = _powers(motion.trajectory, times)
        low = limits.positions[:, 0]
        wrong = (values[0] < low - SLACK) | (values[0] > bounds[0] + SLACK)
        for order in (1, 2, 3):
            wrong |= np.abs(values[order]) > bounds[order] * (1 + SLACK)
        count += int(wrong.any(axis=1).sum())
        if last is not None:
            count += int(np.abs(values[:3, 0] - last).max() > 1e-6)
        last = _powers(motion.trajectory, np.array([end - motion.start]))[:3, 0]
    return count


def _powers(trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    """Return position, velocity, acceleration and jerk, (4, n, J)."""
    piece = np.clip(np.searchsorted(trajectory.breaks, times, side="right") - 1, 0, len(trajectory.coefficients) - 1)
    x = (times - trajectory.breaks[piece])[:, None]
    coefficients = trajectory.coefficients[piece]
    found = []
    for order in range(4):
        total = np.zeros(coefficients.shape[:2])
        for power in range(order, COEFFICIENTS):
            factor = np.prod(np.arange(power - order + 1, power + 1), dtype=float)
            total += factor * coefficients[:, :, power] * x ** (power - order)
        found.append(total)
    return np.array(found)


class ArmCheck:
    """Records the arm of an environment at every step of its physics, without changing what the environment does."""

    def __init__(self, env: Any, limits: Limits) -> None:
        self._env, self._limits = env, limits
        self._step = float(env.model.opt.timestep)
        self._states: list[np.ndarray] = []
        simulate = env.do_simulation

        def do_simulation(action: np.ndarray, frames: int) -> None:
            simulate(action, frames)
            # The environment looks for a hit after the step, so the step of the hit itself is still recorded.
            if not env._hit_ball:
                self._states.append(self._state())

        env.do_simulation = do_simulation

    def begin(self) -> None:
        """Begin a ball."""
        self._states = [self._state()]

    def judge(self, motions: Sequence[Motion]) -> tuple[int, float, float]:
        """Return `arm_violations`, `arm_acceleration` and `off_plan` of a `Ball`.

        Between two steps the environment's arm moves with constant velocity, so no instant is left out.
        """
        states = np.array(self._states[:-1] if self._env._hit_ball else self._states)
        positions, velocities = states[:, :JOINTS], states[:, JOINTS:]
        limits = self._limits
        low, high = limits.positions.T
        wrong = (positions < low - SLACK) | (positions > high + SLACK)
        wrong |= np.abs(velocities) > limits.velocities * (1 + SLACK)
        used = np.abs(np.diff(velocities, axis=0)) / self._step / limits.accelerations
        times = self._step * np.arange(len(states))
        off = 0.0
        for motion, until in zip(motions, [*(motion.start for motion in motions[1:]), np.inf], strict=True):
            part = (times >= motion.start) & (times < until)
            if part.any():
                planned = motion.trajectory.sample(times[part] - motion.start).positions
                off = max(off, float(np.abs(positions[part] - planned).max()))
        return int(wrong.any(axis=1).sum()), round(float(used.max(initial=0.0)), 3), round(off, 4)

    def _state(self) -> np.ndarray:
        data = self._env.data
        return np.concatenate([data.qpos[:JOINTS], data.qvel[:JOINTS]])
