"""The arm as something that holds a racket: where it can be, and how it gives way."""

from dataclasses import dataclass, fields
from functools import cached_property

import mujoco
import numpy as np

from robot.description import RobotConfig
from robot.model import joint_ids
from robot.striking.chain import Chain
from robot.striking.flight import Ball

DAMPING = 1e-3
"""Damping of the descent, in units of its rows, m and rad."""
LONGEST = 0.4
"""Longest step of a descent on one joint, rad."""
TURNING = 0.02
"""Weight of turning the normal during the strike, s², beside joint velocities as parts of their limits."""


class Rows:
    """A dataclass of arrays with the same first axis."""

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))  # pyright: ignore[reportArgumentType]

    def take(self, rows: np.ndarray):  # noqa: ANN201 - the subclass
        """Return the same with some of the rows."""
        return type(self)(*(getattr(self, field.name)[rows] for field in fields(self)))  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True, slots=True, eq=False)
class Postures(Rows):
    """Postures, values (n, J), rad, with the racket at positions (n, 3), m, its z axes `normals` (n, 3).

    moves, turns: derivatives of both by the joints, (n, 3, J).
    """

    values: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    moves: np.ndarray
    turns: np.ndarray

    def are_within(self, positions: np.ndarray, normals: np.ndarray, metres: float, radians: float) -> np.ndarray:
        """Return which (n,) have the racket so near to positions and normals (n, 3)."""
        apart = (np.linalg.norm(a - b, axis=1) for a, b in ((self.positions, positions), (self.normals, normals)))
        return (next(apart) < metres) & (next(apart) < radians)


@dataclass(frozen=True, slots=True)
class Racket:
    """The striking face: radius of its strings, half of its thickness (m), whether both sides strike.

    Its middle is the tool site, its normal the site's z axis.
    """

    radius: float
    thickness: float
    two_sided: bool = False


class Arm:
    """Kinematics and mobility of an arm with a racket, of many postures at once. It holds its own MuJoCo data."""

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
    def fixed(self) -> np.ndarray:
        """Points on joints' axes that no joint moves, (n, 3), m: the base and the shoulder."""
        low, high = np.where(np.isfinite(self.limits.positions), self.limits.positions, [-1.0, 1.0]).T
        anchors = self.chain.anchors(np.stack([self.config.home, 0.7 * low + 0.3 * high, 0.4 * low + 0.6 * high]))
        return anchors[0][np.ptp(anchors, axis=0).max(axis=1) < 1e-9]

    @property
    def offset(self) -> float:
        """Distance of the ball's centre from the racket's middle when they touch, m."""
        return self.ball.radius + self.racket.thickness

    def descend(
        self, positions: np.ndarray, normals: np.ndarray, seeds: np.ndarray, rounds: int, turning: float = 1.0
    ) -> "Postures":
        """Return postures near seeds (n, J) with the racket at positions and normals (n, 3), inside the ranges.

        Damped Gauss–Newton, a joint at its range held there. Whether a posture is exact its caller must see. turning:
        m, what a radian of the normal counts where not all can be met.
        """
        low, high = self.limits.positions.T
        q, wanted = np.clip(seeds, low, high), np.concatenate([positions, normals], axis=1)
        for _ in range(rounds):
            position, normal, rows = self.chain.jacobians(q)
            error = wanted - np.concatenate([position, normal], axis=1)
            if turning != 1:
                rows[:, 3:] *= turning
                error[:, 3:] *= turning
            step = _least(rows, error)
            blocked = ((q <= low) & (step < 0)) | ((q >= high) & (step > 0))
            if blocked.any():
                some = blocked.any(axis=1)
                rows[some] *= ~blocked[some, None, :]
                step[some] = _least(rows[some], error[some])
            step *= np.minimum(1.0, LONGEST / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-9))
            q = np.minimum(np.maximum(q + step, low), high)  # np.clip takes three times as long
        return self.postures(q)

    def postures(self, values: np.ndarray) -> "Postures":
        """Return what the racket does in postures (n, J)."""
        position, normal, by_joints = self.chain.jacobians(values)
        return Postures(values, position, normal, by_joints[:, :3], by_joints[:, 3:])

    def mobility(self, postures: "Postures") -> np.ndarray:
        """Return C = J M⁻¹ Jᵀ + I/m_b (n, 3, 3), 1/kg: how racket and ball part for a unit of impulse between them."""
        values, moves = postures.values, postures.moves
        masses = np.array([self._mass(posture) for posture in values]).reshape(-1, *[values.shape[1]] * 2)
        return moves @ np.linalg.solve(masses, moves.transpose(0, 2, 1)) + np.eye(3) / self.ball.mass

    def response(self, posture: np.ndarray, impulse: np.ndarray) -> np.ndarray:
        """Return M⁻¹ Jᵀ p (J,), rad/s: by how much an impulse p (3,), N·s, at the racket changes joint velocities."""
        masses = self._mass(posture)
        mujoco.mj_jacSite(self._model, self._data, self._jacobian, None, self._site)
        return np.linalg.solve(masses, self._jacobian[:, self._dofs].T @ impulse)

    def velocities(self, postures: "Postures", wanted: np.ndarray) -> np.ndarray:
        """Return joint velocities (n, J) that move the racket with `wanted` (n, 3), m/s, and turn it little."""
        moves, turns = postures.moves, postures.turns
        speeds = np.where(np.isfinite(self.limits.velocities), self.limits.velocities, 10.0)
        weights = np.diag(speeds**-2.0) + TURNING * turns.transpose(0, 2, 1) @ turns
        eased = np.linalg.solve(weights, moves.transpose(0, 2, 1))
        inner = moves @ eased + 1e-9 * np.eye(3)
        return (eased @ np.linalg.solve(inner, wanted[:, :, None]))[:, :, 0]

    def stoppable(self, postures: np.ndarray, after: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and highest joint velocities (n, J) that stop inside the ranges, kept for `after` (s)."""
        limits = self.limits
        low, high = limits.positions.T
        # The way to rest is at most v t + v²/2a + v a/2j.
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


def _least(rows: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return the shortest damped steps (n, J) with rows (n, m, J) · step = error (n, m)."""
    turned = rows.transpose(0, 2, 1)
    inner = rows @ turned + DAMPING**2 * np.eye(rows.shape[1])
    return (turned @ np.linalg.solve(inner, error[:, :, None]))[:, :, 0]
