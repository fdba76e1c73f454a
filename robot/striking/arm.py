"""An arm with a racket: kinematics, mobility, and joint velocities from which it can stop."""

from dataclasses import dataclass, fields
from functools import cached_property

import mujoco
import numpy as np

from robot.description import RobotConfig
from robot.model import joint_ids
from robot.striking.chain import Chain
from robot.striking.flight import Ball

DAMPING = 1e-3
"""Damping of the descent, in units of its residuals: m and rad."""
MAX_STEP = 0.4
"""Largest step of one joint in a descent, rad."""
ROTATION_WEIGHT = 0.02
"""Weight of the normal's rotation during the strike, s², relative to joint velocities in units of their limits."""


class Rows:
    """A dataclass of arrays with the same first axis."""

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))  # pyright: ignore[reportArgumentType]

    def take(self, rows: np.ndarray):  # noqa: ANN201 - the subclass
        """Return the same dataclass with a selection of rows."""
        return type(self)(*(getattr(self, field.name)[rows] for field in fields(self)))  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True, slots=True, eq=False)
class Postures(Rows):
    """Postures with joint values (n, J), rad, the racket at positions (n, 3), m, and its z axes `normals` (n, 3).

    moves, turns: derivatives of positions and normals by the joints, (n, 3, J).
    """

    values: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    moves: np.ndarray
    turns: np.ndarray

    def are_within(self, positions: np.ndarray, normals: np.ndarray, metres: float, radians: float) -> np.ndarray:
        """Return which postures (n,) have the racket within these distances of positions and normals (n, 3)."""
        apart = (np.linalg.norm(a - b, axis=1) for a, b in ((self.positions, positions), (self.normals, normals)))
        return (next(apart) < metres) & (next(apart) < radians)


@dataclass(frozen=True, slots=True)
class Racket:
    """The striking face: radius of the strings, half of the thickness (m), whether both sides strike.

    Its centre is the tool site, its normal the site's z axis.
    """

    radius: float
    thickness: float
    two_sided: bool = False


class Arm:
    """Kinematics and mobility of an arm with a racket, for many postures at once. It owns its MuJoCo data."""

    def __init__(self, config: RobotConfig, racket: Racket, ball: Ball) -> None:
        self.config = config
        self.racket = racket
        self.ball = ball
        self.limits = config.limits
        self.chain = Chain(config)
        self._model = config.model
        self._data = mujoco.MjData(config.model)
        self._data.qpos[:] = config.pose_at_home
        joints = joint_ids(config.model, config.joint_names)
        self._qpos = config.model.jnt_qposadr[joints]
        self._dofs = dofs = config.model.jnt_dofadr[joints]
        self._square = np.ix_(dofs, dofs)
        self._full = np.zeros((config.model.nv, config.model.nv))
        self._site = config.model.site(config.tool.site).id
        self._jacobian = np.zeros((3, config.model.nv))

    @cached_property
    def fixed_points(self) -> np.ndarray:
        """Points on joint axes that no joint moves, (n, 3), m: the base and the shoulder."""
        low, high = np.where(np.isfinite(self.limits.positions), self.limits.positions, [-1.0, 1.0]).T
        anchors = self.chain.anchors(np.stack([self.config.home, 0.7 * low + 0.3 * high, 0.4 * low + 0.6 * high]))
        return anchors[0][np.ptp(anchors, axis=0).max(axis=1) < 1e-9]

    @property
    def offset(self) -> float:
        """Distance of the ball's centre from the racket's centre when they touch, m."""
        return self.ball.radius + self.racket.thickness

    def descend(
        self, positions: np.ndarray, normals: np.ndarray, seeds: np.ndarray, rounds: int, turning: float = 1.0
    ) -> Postures:
        """Return postures near seeds (n, J) with the racket at positions and normals (n, 3), inside the joint ranges.

        Damped Gauss–Newton; a joint at the end of its range stays there. The caller must check the residuals. turning:
        m, weight of one radian of the normal if position and normal cannot both be reached.
        """
        low, high = self.limits.positions.T
        q, wanted = np.clip(seeds, low, high), np.concatenate([positions, normals], axis=1)
        for _ in range(rounds):
            position, normal, rows = self.chain.jacobians(q)
            error = wanted - np.concatenate([position, normal], axis=1)
            if turning != 1:
                rows[:, 3:] *= turning
                error[:, 3:] *= turning
            step = _least_squares_step(rows, error)
            blocked = ((q <= low) & (step < 0)) | ((q >= high) & (step > 0))
            if blocked.any():
                some = blocked.any(axis=1)
                rows[some] *= ~blocked[some, None, :]
                step[some] = _least_squares_step(rows[some], error[some])
            step *= np.minimum(1.0, MAX_STEP / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-9))
            q = np.minimum(np.maximum(q + step, low), high)  # np.clip takes three times as long
        return self.postures(q)

    def postures(self, values: np.ndarray) -> Postures:
        """Return the racket's position and normal, with derivatives, in postures (n, J)."""
        position, normal, by_joints = self.chain.jacobians(values)
        return Postures(values, position, normal, by_joints[:, :3], by_joints[:, 3:])

    def mobility(self, postures: Postures) -> np.ndarray:
        """Return C = J M⁻¹ Jᵀ + I/m_b (n, 3, 3), 1/kg: relative velocity of racket and ball a unit of impulse."""
        values, moves = postures.values, postures.moves
        masses = np.array([self._mass(posture) for posture in values]).reshape(-1, *[values.shape[1]] * 2)
        return moves @ np.linalg.solve(masses, moves.transpose(0, 2, 1)) + np.eye(3) / self.ball.mass

    def response(self, posture: np.ndarray, impulse: np.ndarray) -> np.ndarray:
        """Return M⁻¹ Jᵀ p (J,), rad/s: change of joint velocities by an impulse p (3,), N·s, on the racket."""
        masses = self._mass(posture)
        mujoco.mj_jacSite(self._model, self._data, self._jacobian, None, self._site)
        return np.linalg.solve(masses, self._jacobian[:, self._dofs].T @ impulse)

    def velocities(self, postures: Postures, wanted: np.ndarray) -> np.ndarray:
        """Return joint velocities (n, J) that move the racket with `wanted` (n, 3), m/s, with little rotation."""
        moves, turns = postures.moves, postures.turns
        speeds = np.where(np.isfinite(self.limits.velocities), self.limits.velocities, 10.0)
        weights = np.diag(speeds**-2.0) + ROTATION_WEIGHT * turns.transpose(0, 2, 1) @ turns
        eased = np.linalg.solve(weights, moves.transpose(0, 2, 1))
        inner = moves @ eased + 1e-9 * np.eye(3)
        return (eased @ np.linalg.solve(inner, wanted[:, :, None]))[:, :, 0]

    def stoppable(self, postures: np.ndarray, after: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and highest joint velocities (n, J) from which a joint can stop inside its range.

        after: s, for which the velocity is kept before the stop.
        """
        limits = self.limits
        low, high = limits.positions.T
        # The stopping distance is at most v t + v²/2a + v a/2j.
        a, t = limits.accelerations, after + limits.accelerations / limits.jerks / 2
        down, up = (
            a * (np.sqrt(t * t + 2 * np.maximum(room, 0) / a) - t) for room in (postures - low, high - postures)
        )
        return -down, up

    def _mass(self, posture: np.ndarray) -> np.ndarray:
        model, data = self._model, self._data
        data.qpos[self._qpos] = posture
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        mujoco.mj_fullM(model, data, self._full)
        return self._full[self._square]


def _least_squares_step(rows: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return the least damped steps (n, J) with rows (n, m, J) · step = error (n, m)."""
    turned = rows.transpose(0, 2, 1)
    inner = rows @ turned + DAMPING**2 * np.eye(rows.shape[1])
    return (turned @ np.linalg.solve(inner, error[:, :, None]))[:, :, 0]
