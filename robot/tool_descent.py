"""Iterative inverse kinematics: from a seed to a posture with the tool at a pose.

mink computes the residual of the tool's pose and its Jacobian. A damped Gauss-Newton descent inside the joint ranges
reduces the residual; then a redundant arm moves in its null space towards a preferred posture. Steps are counted, not
timed, so every machine returns the same result.
"""

from math import sqrt
from typing import Any

import mink
import mujoco
import numpy as np
from scipy.linalg import get_lapack_funcs

from robot.description import RobotConfig
from robot.kinematics import Kinematics
from robot.tool_target import Posture, ToolTarget

MET, AIMED_AT, AIMED_AT_BY_PULLS = 1e-7, 1e-10, 1e-8
"""Largest error (m, rad) of a pose that counts as met; errors at which a descent ends, from a seed and in the null
space. A stretched-out arm converges to them only slowly."""
STEPS, PULLS, STEPS_A_PULL = 30, 6, 6
"""Limits on the steps of a descent, on the moves in the null space, and on the correcting steps after each move."""
STALL_RATIO, STALL_STEPS = 0.9, 5
"""A descent ends if more than this fraction of the error remains after each of this many steps."""
PULL_GAIN, LEAST_PULL = 0.9, 0.005
"""Null-space motion ends if a move leaves more than this fraction of the distance, or is shorter than this (rad)."""
FIRST_DAMPING, LEAST_DAMPING = 0.1, 1e-4
LONGEST_STEP = 0.8
"""Largest step of any joint, rad, for which the linearisation is valid."""
FULL_TURN = 2 * np.pi

_SOLVE: Any = get_lapack_funcs("posv", dtype=np.float64)
"""Solve a positive definite system, without argument checks, which would take longer than six equations."""


class ToolDescent:
    """Descents of one arm. Not thread-safe: use one a thread.

    turns: (J,), whether each joint is a hinge.
    """

    def __init__(self, config: RobotConfig) -> None:
        kinematics = Kinematics(config)
        model, ids = kinematics.model, kinematics.joint_ids
        self.turns = model.jnt_type[ids] == int(mujoco.mjtJoint.mjJNT_HINGE)
        self._qpos, self._dofs = model.jnt_qposadr[ids], model.jnt_dofadr[ids]
        self._site = kinematics.site
        self._frame = mink.FrameTask(self._site, "site", position_cost=1.0, orientation_cost=1.0)
        self._configuration = mink.Configuration(model, config.pose_at_home)
        data = self._configuration.data
        self._at, self._turn = data.site_xpos[self._site], data.site_xmat[self._site].reshape(3, 3)
        accelerations = config.limits.accelerations
        scale = np.where(np.isfinite(accelerations), accelerations, 1.0)
        self._weights = scale / scale.max()

    def descend(
        self,
        target: ToolTarget,
        positions: np.ndarray,
        ranges: np.ndarray,
        steps: int = STEPS,
        aimed_at: float = AIMED_AT,
    ) -> tuple[np.ndarray, float]:
        """Descend to the pose from joint positions (J,) inside `ranges` (J, 2); return the result and its error."""
        self._aim(target)
        low, high = np.ascontiguousarray(ranges.T)
        error, rows = self._error(target, positions)
        damping, size, stalled = FIRST_DAMPING, sqrt(error @ error), 0
        for _ in range(steps):
            if size <= aimed_at or stalled >= STALL_STEPS:
                break
            step = _step(rows, error, damping, positions <= low, positions >= high)
            tried = np.minimum(np.maximum(positions + step, low), high)
            next_error, next_rows = self._error(target, tried)
            next_size = sqrt(next_error @ next_error)
            stalled = stalled + 1 if next_size > STALL_RATIO * size else 0
            if next_size < size:
                positions, error, rows, size = tried, next_error, next_rows, next_size
                damping = max(damping / 8, LEAST_DAMPING)
            else:
                damping = 6 * max(damping, 1e-3)
        return positions, size

    def pull(self, target: ToolTarget, positions: np.ndarray, preferred: np.ndarray, ranges: np.ndarray) -> np.ndarray:
        """Return the posture that meets the target and is nearest to the preferred one along the null space."""
        self._aim(target)
        for _ in range(PULLS):
            _, rows = self._error(target, positions)
            away = (preferred - positions) / self._weights
            _, values, basis = np.linalg.svd(rows * self._weights)
            spanned = basis[: int(np.sum(values > 1e-6))]
            move = self._weights * (away - spanned.T @ (spanned @ away))
            longest = np.abs(move).max()
            if longest < LEAST_PULL:
                break
            move *= min(1.0, LONGEST_STEP / longest)
            begin = np.clip(positions + move, *ranges.T)
            tried, error = self.descend(target, begin, ranges, STEPS_A_PULL, AIMED_AT_BY_PULLS)
            left = self.distance(tried, preferred) / float(np.linalg.norm(away))
            if error <= MET and left < 1.0:
                positions = tried
            if error > MET or left > PULL_GAIN:
                break
        return positions

    def distance(self, positions: np.ndarray, preferred: np.ndarray) -> float:
        """Return the distance of two postures, with joints weighted by their acceleration limits."""
        return float(np.linalg.norm((positions - preferred) / self._weights))

    def wind(self, positions: np.ndarray, preferred: np.ndarray, ranges: np.ndarray) -> np.ndarray:
        """Return the same posture, turned by whole turns towards the preferred one as far as the ranges allow."""
        turned = positions - FULL_TURN * np.round((positions - preferred) / FULL_TURN)
        inside = self.turns & (turned >= ranges[:, 0]) & (turned <= ranges[:, 1])
        return np.where(inside, turned, positions)

    def motion(self, target: ToolTarget, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rows (m, J) of the tool's Jacobian and their required velocities (m,), in the tool's frame."""
        turned = self._place(positions).rotation().as_matrix().T
        rows = self._configuration.get_frame_jacobian(self._site, "site")[:, self._dofs]
        asked = (rows[:3], target.velocity), (rows[3:], target.angular_velocity)
        given = [(part, turned @ wish) for part, wish in asked if wish is not None]
        return np.concatenate([part for part, _ in given]), np.concatenate([wish for _, wish in given])

    def posture(self, target: ToolTarget, positions: np.ndarray) -> Posture:
        """Return the tool's pose at joint positions (J,), and its distance from the target."""
        pose = self._place(positions)
        rotation = pose.rotation().as_matrix()
        cosine = 1.0
        if target.rotation is not None:
            cosine = (np.trace(rotation.T @ target.rotation) - 1) / 2
        elif target.axis is not None:
            cosine = rotation[:, 2] @ target.axis
        distance = float(np.linalg.norm(pose.translation() - target.position))
        angle = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
        return Posture(positions, distance, angle, pose.translation().copy(), pose.rotation().wxyz.copy())

    def _place(self, positions: np.ndarray) -> mink.SE3:
        self._configuration.data.qpos[self._qpos] = positions
        self._configuration.update()
        return self._configuration.get_transform_frame_to_world(self._site, "site")

    def _aim(self, target: ToolTarget) -> None:
        """Set the target."""
        if target.rotation is not None:
            rotation = mink.SO3.from_matrix(target.rotation)
            self._frame.set_target(mink.SE3.from_rotation_and_translation(rotation, target.position))

    def _error(self, target: ToolTarget, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the residual of the tool's pose (3 or 6 numbers, m and rad, in its frame), and its Jacobian."""
        self._configuration.data.qpos[self._qpos] = positions
        self._configuration.update()
        if target.rotation is not None:
            rows, correction, _ = self._frame.compute_qp_residual(self._configuration)
            return -correction, rows[:, self._dofs]
        rows = self._configuration.get_frame_jacobian(self._site, "site")[:, self._dofs]
        away = self._turn.T @ (self._at - target.position)
        if target.axis is None:
            return away, rows[:3]
        x, y, z = self._turn.T @ target.axis
        turning = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]) @ rows[3:]
        return np.concatenate([away, [-x, -y, 1.0 - z]]), np.concatenate([rows[:3], turning])


def _step(rows: np.ndarray, error: np.ndarray, damping: float, lowest: np.ndarray, highest: np.ndarray) -> np.ndarray:
    """Return the damped Gauss-Newton step (J,) of the joints that are not blocked by an end of their range.

    lowest, highest: (J,), whether each joint is at that end of its range.
    """
    free, step = np.ones(len(lowest), dtype=bool), np.zeros(len(lowest))
    for _ in range(len(lowest)):
        part = rows * free
        gram = part @ part.T
        gram.flat[:: len(error) + 1] += damping**2
        step = -part.T @ _SOLVE(gram, error)[1]
        held = free & ((lowest & (step < 0)) | (highest & (step > 0)))
        if not held.any() or held.sum() == free.sum():
            break
        free &= ~held
    shorter: float = min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
    return shorter * step
