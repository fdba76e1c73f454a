"""Postures that bring the tool to a pose, and joint velocities that move it as asked.

Geometry is mink's: its tasks say how far a tool is from its pose and how joints change that. From several seeds a
damped Gauss-Newton descent inside the joints' ranges leads to postures; a redundant arm then moves in its null space
towards a preferred one. Effort is counted, not timed, so every machine returns the same answer.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mink
import mujoco
import numpy as np

from robot.description import RobotConfig
from robot.kinematics import Kinematics

MET, AIMED_AT = 1e-7, 1e-10
"""Distance (m) and angle (rad) up to which a pose is met, and at which a descent ends: it comes nearly always, but
slowly where the arm is stretched out."""
RANDOM_SEEDS, FURTHER_SEEDS = 6, 30
"""Random postures from which to search, and how many more where no posture was found."""
STEPS, PULLS, STEPS_A_PULL = 30, 6, 6
"""Steps of a descent, moves in the null space, and steps that lead back to the pose after each."""
PULL_GAIN = 0.97
"""A move in the null space that leaves more than this part of the distance to the preferred posture is the last one."""
LEAST_DAMPING = 1e-4
LONGEST_STEP = 0.8
"""rad, on any joint: beyond it the linearisation says nothing."""
STUCK = 0.999, 4
"""A descent ends where this part of the error is left after so many steps in a row."""
PROPORTION = 1e-8
"""Part of a velocity that may be missed."""
SAME_POSTURE = 0.02
"""rad, on any joint."""
FULL_TURN = 2 * np.pi


@dataclass(frozen=True, slots=True, eq=False)
class ToolTarget:
    """Pose and velocity of the tool site in the world frame.

    position: (3,), m. rotation: (3, 3), or None. axis: (3,), unit vector along which the tool's z points, or None; with
    neither the tool may point anywhere. velocity: (3,), m/s, and angular_velocity: (3,), rad/s; None where free.
    """

    position: np.ndarray
    rotation: np.ndarray | None = None
    axis: np.ndarray | None = None
    velocity: np.ndarray | None = None
    angular_velocity: np.ndarray | None = None

    @property
    def anywhere(self) -> "ToolTarget":
        """The same position, with the tool pointing anywhere."""
        return ToolTarget(self.position)


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """Joint positions (J,) and where they have the tool.

    distance (m) and angle (rad) from its target, position (3,) and quaternion (4,), w first.
    """

    positions: np.ndarray
    distance: float
    angle: float
    position: np.ndarray
    quaternion: np.ndarray


class Unreachable(Exception):
    """No posture was found that meets a target; `str()` says why and what comes nearest.

    reason: out of reach, joint ranges, orientation or velocity. nearest: the posture that comes nearest.
    """

    def __init__(self, reason: str, sentence: str, nearest: Posture) -> None:
        super().__init__(sentence)
        self.reason = reason
        self.nearest = nearest


class InverseKinematics:
    """Postures of one arm. It holds its own MuJoCo data: use one per thread."""

    def __init__(self, config: RobotConfig) -> None:
        self._names = config.joint_names
        kinematics = Kinematics(config)
        model, ids = kinematics.model, kinematics.joint_ids
        self._qpos, self._dofs = model.jnt_qposadr[ids], model.jnt_dofadr[ids]
        self._turns = model.jnt_type[ids] == int(mujoco.mjtJoint.mjJNT_HINGE)
        self._site = kinematics.site
        self._frame = mink.FrameTask(self._site, "site", position_cost=1.0, orientation_cost=1.0)
        self._pointing = mink.AxisAlignTask(self._site, "site")
        self._configuration = mink.Configuration(model, kinematics.resting)
        accelerations = config.limits.accelerations
        scale = np.where(np.isfinite(accelerations), accelerations, 1.0)
        self._weights = scale / scale.max()
        self._spread = np.random.default_rng(0).uniform(size=(RANDOM_SEEDS + FURTHER_SEEDS, len(ids)))

    def postures(self, target: ToolTarget, ranges: np.ndarray, seeds: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return postures (J,) inside `ranges` (J, 2) that meet a target, the nearest to the first seed first.

        Searched from the seeds (J,) and from some drawn at random, always the same. A redundant arm comes as near to
        the first seed as the target allows.

        Raises:
            Unreachable: none was found.
        """
        preferred = np.clip(seeds[0], *ranges.T)
        found: list[np.ndarray] = []
        nearest, least = preferred, np.inf
        for count, seed in enumerate(self._seeds(seeds, ranges)):
            if found and count >= len(seeds) + RANDOM_SEEDS:
                break
            positions, error = self._descent(target, seed, ranges)
            if error < least:
                nearest, least = positions, error
            if error <= MET:
                near = self._wound(self._pulled(target, positions, preferred, ranges), preferred, ranges)
                if all(np.abs(near - other).max() > SAME_POSTURE for other in found):
                    found.append(near)
        if not found:
            raise self._unreachable(target, ranges, seeds, self._posture(target, nearest))
        return sorted(found, key=lambda positions: float(np.linalg.norm((positions - preferred) / self._weights)))

    def nearby(self, target: ToolTarget, ranges: np.ndarray, seed: np.ndarray) -> np.ndarray | None:
        """Return the posture (J,) to which a descent from the seed alone leads, None where it meets no target."""
        seed = np.clip(seed, *ranges.T)
        positions, error = self._descent(target, seed, ranges)
        return self._pulled(target, positions, seed, ranges) if error <= MET else None

    def velocities(self, target: ToolTarget, positions: np.ndarray, limits: np.ndarray) -> np.ndarray:
        """Return the joint velocities (J,) that move the tool as the target says, least in units of the limits (J,).

        Joints that would pass their limit keep it and the others make up for it, where the arm is redundant. A target
        without velocities is at rest.

        Raises:
            Unreachable: they pass a limit, or no velocities move the tool so.
        """
        if target.velocity is None and target.angular_velocity is None:
            return np.zeros(len(positions))
        rows, wanted = self._motion(target, positions)
        scale = np.where(np.isfinite(limits), limits, 1.0)
        free, found = np.ones(len(positions), dtype=bool), np.zeros(len(positions))
        first = None
        while free.any():
            rest = wanted - rows[:, ~free] @ found[~free]
            found[free] = scale[free] * (np.linalg.pinv(rows[:, free] * scale[free], rcond=1e-6) @ rest)
            missed = np.linalg.norm(rows @ found - wanted)
            first = found.copy() if first is None else first
            if missed > PROPORTION * max(1.0, float(np.linalg.norm(wanted))):
                break
            worst = int(np.argmax(np.abs(found) / limits))
            if abs(found[worst]) <= limits[worst]:
                return found
            free[worst], found[worst] = False, np.copysign(limits[worst], found[worst])
        assert first is not None
        raise Unreachable("velocity", self._too_fast(first, rows, wanted, limits), self._posture(target, positions))

    # --- descents ---------------------------------------------------------------------------------------

    def _seeds(self, seeds: Sequence[np.ndarray], ranges: np.ndarray) -> Iterator[np.ndarray]:
        """The given seeds, then random ones: inside the ranges, and within half a turn of the first."""
        low, high = ranges.T
        yield from (np.clip(seed, low, high) for seed in seeds)
        around = np.clip(seeds[0], low, high)
        low, high = np.maximum(low, around - np.pi), np.minimum(high, around + np.pi)
        yield from low + self._spread * (high - low)

    def _descent(
        self, target: ToolTarget, positions: np.ndarray, ranges: np.ndarray, steps: int = STEPS
    ) -> tuple[np.ndarray, float]:
        """Lead a seed to the pose; return where it ends and what is left of the error."""
        error, rows = self._error(target, positions)
        damping, size, stuck = 0.1, float(np.linalg.norm(error)), 0
        for _ in range(steps):
            if size <= AIMED_AT or stuck >= STUCK[1]:
                break
            tried = np.clip(positions + _step(rows, error, damping, positions, ranges), *ranges.T)
            next_error, next_rows = self._error(target, tried)
            next_size = float(np.linalg.norm(next_error))
            stuck = stuck + 1 if next_size > STUCK[0] * size else 0
            if next_size < size:
                positions, error, rows, size = tried, next_error, next_rows, next_size
                damping = max(damping / 8, LEAST_DAMPING)
            else:
                damping = max(damping, 1e-3) * 6
        return positions, size

    def _pulled(
        self, target: ToolTarget, positions: np.ndarray, preferred: np.ndarray, ranges: np.ndarray
    ) -> np.ndarray:
        """Move in the null space towards the preferred posture, as the arm's accelerations weigh it."""
        for _ in range(PULLS):
            _, rows = self._error(target, positions)
            away = (preferred - positions) / self._weights
            _, values, basis = np.linalg.svd(rows * self._weights)
            spanned = basis[: int(np.sum(values > 1e-6))]
            pull = self._weights * (away - spanned.T @ (spanned @ away))
            if np.abs(pull).max() < SAME_POSTURE / 4:
                break
            pull *= min(1.0, LONGEST_STEP / np.abs(pull).max())
            tried, error = self._descent(target, np.clip(positions + pull, *ranges.T), ranges, STEPS_A_PULL)
            left = np.linalg.norm((preferred - tried) / self._weights) / np.linalg.norm(away)
            if error <= MET and left < 1.0:
                positions = tried
            if error > MET or left > PULL_GAIN:
                break
        return positions

    def _wound(self, positions: np.ndarray, preferred: np.ndarray, ranges: np.ndarray) -> np.ndarray:
        """Whole turns nearer to the preferred posture, where the ranges allow it."""
        turned = positions - FULL_TURN * np.round((positions - preferred) / FULL_TURN)
        inside = self._turns & (turned >= ranges[:, 0]) & (turned <= ranges[:, 1])
        return np.where(inside, turned, positions)

    # --- the tool ---------------------------------------------------------------------------------------

    def _place(self, positions: np.ndarray) -> mink.SE3:
        self._configuration.data.qpos[self._qpos] = positions
        self._configuration.update()
        return self._configuration.get_transform_frame_to_world(self._site, "site")

    def _error(self, target: ToolTarget, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far the tool is from its pose (m, rad; 3 or 6 numbers), and its Jacobian."""
        pose = self._place(positions)
        rotation = pose.rotation() if target.rotation is None else mink.SO3.from_matrix(target.rotation)
        self._frame.set_target(mink.SE3.from_rotation_and_translation(rotation, target.position))
        rows, correction, _ = self._frame.compute_qp_residual(self._configuration)
        rows, error = rows[:, self._dofs], -correction
        if target.rotation is not None:
            return error, rows
        if target.axis is None:
            return error[:3], rows[:3]
        self._pointing.set_target(target.axis)
        turning, correction, _ = self._pointing.compute_qp_residual(self._configuration)
        return np.concatenate([error[:3], -correction]), np.concatenate([rows[:3], turning[:, self._dofs]])

    def _motion(self, target: ToolTarget, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the tool's Jacobian and the velocities that are asked of them, in the tool's frame."""
        turned = self._place(positions).rotation().as_matrix().T
        rows = self._configuration.get_frame_jacobian(self._site, "site")[:, self._dofs]
        asked = [(part, wish) for part, wish in ((rows[:3], target.velocity), (rows[3:], target.angular_velocity))]
        given = [(part, turned @ wish) for part, wish in asked if wish is not None]
        return np.concatenate([part for part, _ in given]), np.concatenate([wish for _, wish in given])

    def _posture(self, target: ToolTarget, positions: np.ndarray) -> Posture:
        pose = self._place(positions)
        rotation = pose.rotation().as_matrix()
        angle = 0.0
        if target.rotation is not None:
            angle = float(np.arccos(np.clip((np.trace(rotation.T @ target.rotation) - 1) / 2, -1, 1)))
        elif target.axis is not None:
            angle = float(np.arccos(np.clip(rotation[:, 2] @ target.axis, -1, 1)))
        distance = float(np.linalg.norm(pose.translation() - target.position))
        return Posture(positions, distance, angle, pose.translation(), pose.rotation().wxyz)

    # --- what stands in the way -------------------------------------------------------------------------

    def _unreachable(
        self, target: ToolTarget, ranges: np.ndarray, seeds: Sequence[np.ndarray], nearest: Posture
    ) -> Unreachable:
        """Find out why no posture meets a target."""
        wide = np.where(self._turns[:, None], [-np.inf, np.inf], ranges)

        def met(wanted: ToolTarget, within: np.ndarray) -> bool:
            return any(self._descent(wanted, seed, within)[1] <= MET for seed in self._seeds(seeds, ranges))

        points = target.rotation is not None or target.axis is not None
        if met(target, wide):
            reason, why = "joint ranges", "every posture that brings it there is outside the joint ranges"
        elif points and met(target.anywhere, ranges):
            reason, why = "orientation", "the arm can be there, but no posture was found in which the tool points so"
        elif points and met(target.anywhere, wide):
            reason, why = "joint ranges", "every posture that brings it there is outside the joint ranges"
        else:
            reason, why = "out of reach", "it is farther than the arm reaches"
        away = f"{nearest.distance:.3g} m" + (f" and {nearest.angle:.3g} rad" if points else "")
        sentence = (
            f"the tool cannot be at {_rounded(target.position)}: {why}; "
            f"the nearest pose found is {away} away, at {_rounded(nearest.position)}"
        )
        return Unreachable(reason, sentence, nearest)

    def _too_fast(self, found: np.ndarray, rows: np.ndarray, wanted: np.ndarray, limits: np.ndarray) -> str:
        """Why the tool cannot move as asked, from the velocities (J,) that come nearest to it without limits."""
        missed = wanted - rows @ found
        if np.linalg.norm(missed) > PROPORTION * max(1.0, float(np.linalg.norm(wanted))):
            return "the tool cannot move in this direction from there: the arm is stretched out or has too few joints"
        worst = int(np.argmax(np.abs(found) / limits))
        share = limits[worst] / abs(found[worst])
        return (
            f"the tool's velocity needs {abs(found[worst]):.3g} rad/s of {self._names[worst]}, whose limit is "
            f"{limits[worst]:.3g} rad/s; {np.floor(100 * share) / 100:.2f} of that velocity works"
        )


def rotation_of(quaternion: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a quaternion (4,) w, x, y, z of any length but 0."""
    return mink.SO3(wxyz=quaternion / np.linalg.norm(quaternion)).as_matrix()


def _step(rows: np.ndarray, error: np.ndarray, damping: float, positions: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """Return the damped Gauss-Newton step (J,) of the joints that their ranges do not hold back."""
    free, step = np.ones(len(positions), dtype=bool), np.zeros(len(positions))
    for _ in range(len(positions)):
        part = rows[:, free]
        step[:] = 0.0
        step[free] = -part.T @ np.linalg.solve(part @ part.T + damping**2 * np.eye(len(error)), error)
        held = free & (((positions <= ranges[:, 0]) & (step < 0)) | ((positions >= ranges[:, 1]) & (step > 0)))
        if not held.any() or held.sum() == free.sum():
            break
        free &= ~held
    return step * min(1.0, LONGEST_STEP / max(np.abs(step).max(), 1e-12))


def _rounded(position: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.3f}" for value in position) + "] m"
