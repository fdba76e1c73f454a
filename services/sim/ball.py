"""The simulated ball: throws, aerodynamics with wind, and state."""

import mujoco
import numpy as np

from protocol.codec import bad_message
from protocol.messages import ActiveDisturbance, Ball, BallTruth, Disturb, Throw
from robot.court import BALL, BallConfig
from robot.model import owner_name
from services.sim.model import Scene

TEE_STORE = (0.0, 0.0, -10.0)
"""Position of the unused tee, m."""
REACH = 100.0
"""Largest initial coordinate (m) and velocity (m/s) of the ball, on each axis."""
MAX_SPIN = 1000.0
"""Largest initial spin about each axis, rad/s; a tennis ball reaches 500."""
STRONGEST = 50.0
"""Strongest wind along each axis, m/s; a hurricane has 33."""
Axes = tuple[float, float, float]


class SimulatedBall:
    """The body `ball` of a scene that has one."""

    def __init__(self, config: BallConfig, scene: Scene) -> None:
        self._scene = scene
        assert scene.ball is not None
        self._body = scene.ball
        self._drag, self._magnus = config.drag * config.mass, config.magnus * config.mass
        self._trial: mujoco.MjData | None = None
        self.calm()

    def put(self, ball: Ball) -> None:
        """Place the ball without spin; one at rest gets the tee under it."""
        x, y, z = ball.position
        self._place(ball.position, ball.velocity, (0.0, 0.0, 0.0))
        self._move_tee(TEE_STORE if any(ball.velocity) else (x, y, z - self._body.radius))

    def throw(self, throw: Throw) -> None:
        """Throw the ball from a free position, and remove the tee.

        Raises:
            Refusal: `bad_message` for a position out of reach or inside a body; the ball has not moved then.
        """
        check_reach(position=throw.position, velocity=throw.velocity)
        spin = throw.spin or (0.0, 0.0, 0.0)
        if not np.all(np.abs(spin) <= MAX_SPIN):
            raise bad_message("spin", f"spin is {list(spin)}; it must lie within {MAX_SPIN:g} rad/s of 0 on each axis")
        self._refuse_inside(throw.position)
        self._place(throw.position, throw.velocity, spin)
        self._move_tee(TEE_STORE)

    def blow(self, request: Disturb) -> None:
        """Set the wind to the request's `values` until the next request.

        Raises:
            Refusal: `bad_message`, naming the field.
        """
        values = request.values or []
        if len(values) != 3 or not all(abs(value) <= STRONGEST for value in values):
            sentence = f"values is {values}; of 'wind' it must be three numbers within {STRONGEST:g} m/s of 0"
            raise bad_message("values", sentence)
        x, y, z = values
        self._wind = x, y, z

    def calm(self) -> None:
        """Set the wind to 0."""
        self._wind: Axes = (0.0, 0.0, 0.0)

    def describe(self) -> list[ActiveDisturbance]:
        """Return the wind as published."""
        return [ActiveDisturbance(kind="wind", values=list(self._wind))] if any(self._wind) else []

    def state(self) -> BallTruth:
        """Return position, velocity and spin in the world frame."""
        data, ball = self._scene.data, self._body
        position, velocity = data.qpos[ball.qpos : ball.qpos + 3], data.qvel[ball.dof : ball.dof + 3]
        return BallTruth(position=position.tolist(), velocity=velocity.tolist(), spin=self._spin().tolist())

    def act(self) -> None:
        """Apply the air's force for the coming physics step: −drag·|v|·v + magnus·ω × v per kg, v against the air."""
        data, dof = self._scene.data, self._body.dof
        x, y, z = (speed - air for speed, air in zip(data.qvel[dof : dof + 3].tolist(), self._wind, strict=True))
        brake = -self._drag * (x * x + y * y + z * z) ** 0.5
        force = (brake * x, brake * y, brake * z)
        if self._magnus and data.qvel[dof + 3 : dof + 6].any():
            a, b, c = (self._magnus * self._spin()).tolist()
            force = (force[0] + b * z - c * y, force[1] + c * x - a * z, force[2] + a * y - b * x)
        data.qfrc_applied[dof : dof + 3] = force

    def _spin(self) -> np.ndarray:
        """Return the angular velocity (3,), rad/s, in the world frame; MuJoCo stores it in the ball's frame."""
        data, ball, spin = self._scene.data, self._body, np.zeros(3)
        mujoco.mju_rotVecQuat(spin, data.qvel[ball.dof + 3 : ball.dof + 6], data.qpos[ball.qpos + 3 : ball.qpos + 7])
        return spin

    def _place(self, position: Axes, velocity: Axes, spin: Axes) -> None:
        data, ball = self._scene.data, self._body
        data.qpos[ball.qpos : ball.qpos + 7] = (*position, 1.0, 0.0, 0.0, 0.0)
        data.qvel[ball.dof : ball.dof + 6] = (*velocity, *spin)

    def _move_tee(self, place: Axes) -> None:
        if self._scene.tee is not None:
            self._scene.data.mocap_pos[self._scene.tee] = place

    def _refuse_inside(self, position: Axes) -> None:
        """Raise Refusal if the ball would start inside a body."""
        model = self._scene.model
        trial = self._trial = self._trial or mujoco.MjData(model)
        trial.qpos[:] = self._scene.data.qpos
        trial.qpos[self._body.qpos : self._body.qpos + 3] = position
        if self._scene.tee is not None:
            trial.mocap_pos[self._scene.tee] = TEE_STORE
        mujoco.mj_fwdPosition(model, trial)
        for (first, second), distance in zip(trial.contact.geom.tolist(), trial.contact.dist.tolist(), strict=True):
            names = {owner_name(model, first), owner_name(model, second)}
            if BALL in names and distance < 0:
                (other,) = names - {BALL}
                sentence = f"position: at {list(position)} the ball would be inside {other!r}; choose a place beside it"
                raise bad_message("position", sentence)


def check_reach(**vectors: Axes) -> None:
    """Check that position and velocity of a ball can be simulated.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    for field, vector in vectors.items():
        if not np.all(np.abs(vector) <= REACH):
            sentence = f"{field} is {list(vector)}; it must lie within {REACH:g} (m, m/s) of 0 on each axis"
            raise bad_message(field, sentence)
