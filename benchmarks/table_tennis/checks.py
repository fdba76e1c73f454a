"""Check limits: of the plan at 10 kHz, and of the environment's arm at every physics step."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.table_tennis.balls import Ball
from benchmarks.table_tennis.played import Motion
from benchmarks.table_tennis.scene import was_hit
from motion.limits import Limits
from motion.trajectory import COEFFICIENTS, Trajectory
from protocol.messages import Command

CHECK_HZ = 10_000
SLACK = 1e-6
"""Rounding errors: rad for positions, relative for the other limits."""
JOINTS = 7


def violations(limits: Limits, motions: list[Motion], until: float) -> int:
    """Return the number of instants, 10,000 a second, at which a joint exceeds a limit, plus jumps between motions.

    The planner's code is not used: polynomials and their derivatives are evaluated here.
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
    """Records the arm of an environment at every physics step, without changing the environment."""

    def __init__(self, env: Any, limits: Limits) -> None:
        self._env, self._limits = env, limits
        self._step = float(env.model.opt.timestep)
        self._states: list[np.ndarray] = []
        simulate = env.do_simulation

        def do_simulation(action: np.ndarray, frames: int) -> None:
            simulate(action, frames)
            # The environment detects a hit after the step, so the step of the hit itself is still recorded.
            if not was_hit(env):
                self._states.append(self._state())

        env.do_simulation = do_simulation

    def begin(self) -> None:
        """Begin a ball."""
        self._states = [self._state()]

    def judge(self, ball: Ball, until: float) -> tuple[np.ndarray, np.ndarray]:
        """Record the arm's use of limits before the hit, at most until a time (s).

        Returns times (n,) and positions (n, 7). Between two steps the environment's arm moves with constant velocity,
        so no instant is left out.
        """
        states = np.array(self._states[:-1] if was_hit(self._env) else self._states)
        times = self._step * np.arange(len(states))
        states, times = states[times < until], times[times < until]
        positions, velocities = states[:, :JOINTS], states[:, JOINTS:]
        limits = self._limits
        low, high = limits.positions.T
        wrong = (positions < low - SLACK) | (positions > high + SLACK)
        wrong |= np.abs(velocities) > limits.velocities * (1 + SLACK)
        used = np.abs(np.diff(velocities, axis=0)) / self._step / limits.accelerations
        ball.arm_violations = int(wrong.any(axis=1).sum())
        ball.arm_velocity = largest(np.abs(velocities) / limits.velocities)
        ball.arm_acceleration = largest(used)
        return times, positions

    def steps(self, time: float) -> int:
        """Return the number of physics steps in a time (s)."""
        return round(time / self._step)

    def _state(self) -> np.ndarray:
        data = self._env.data
        return np.concatenate([data.qpos[:JOINTS], data.qvel[:JOINTS]])


def command_violations(limits: Limits, commands: Sequence[Command], tick: float) -> int:
    """Return the number of ticks at which a commanded reference exceeds a limit or is discontinuous.

    Accelerations are means over a tick of `tick` s, and jerks are their differences.
    """
    positions, velocities, accelerations = (
        np.array([getattr(command, name) for command in commands])
        for name in ("positions", "velocities", "feedforward")
    )
    low, high = limits.positions.T
    wrong = (positions < low - SLACK) | (positions > high + SLACK)
    jerks = np.diff(accelerations, axis=0, prepend=accelerations[:1]) / tick
    bounds = limits.velocities, limits.accelerations, limits.jerks
    for values, bound in zip((velocities, accelerations, jerks), bounds, strict=True):
        wrong |= np.abs(values) > bound * (1 + SLACK)
    ahead = np.array([command.next.positions for command in commands[:-1] if command.next])
    wrong[1:] |= np.abs(positions[1:] - ahead) > SLACK
    return int(wrong.any(axis=1).sum())


def distance(motions: Sequence[Motion], times: np.ndarray, positions: np.ndarray) -> float:
    """Return the largest distance (rad) of positions (n, 7) at times (n,) from their plan."""
    ends = [*(motion.start for motion in motions), np.inf][1:]
    found = 0.0
    for motion, until in zip(motions, ends, strict=True):
        part = (times >= motion.start) & (times < until)
        planned = motion.trajectory.sample(times[part] - motion.start).positions if part.any() else positions[part]
        found = max(found, largest(np.abs(positions[part] - planned)))
    return found


def largest(values: np.ndarray) -> float:
    """Return the largest of values, 0 if there are none."""
    return round(float(values.max(initial=0.0)), 4)
