"""A hit in simulation: MuJoCo steps of the contact alone, as a finer model than the contact law."""

from dataclasses import dataclass

import mujoco
import numpy as np

from motion.tracking import tracking_acceleration
from robot.description import RobotConfig
from robot.model import joint_ids
from robot.striking.choice import Choice
from robot.striking.contact import ContactLaw
from robot.striking.flight import GRAVITY

LONGEST_S = 0.04
"""Longest simulated contact, s."""


@dataclass(frozen=True, slots=True, eq=False)
class Touch:
    """The ball after a simulated hit, extrapolated back to the touch: position, velocity (3,), duration (s).

    joint_velocities: of the arm as the ball leaves it, (J,), rad/s.
    """

    position: np.ndarray
    velocity: np.ndarray
    duration: float
    joint_velocities: np.ndarray


class SimulatedContact:
    """Simulates hits with the robot's own model. It owns its model and data: use one a thread.

    ball: the ball's body, on a free joint or on three slides along the world's axes. law: the result is compared with
    it; assign the calibrated one. phases: parts of a simulation step, from its begin to the touch, over which results
    are averaged; empty: the phase of the hit's own time, for a ball whose flight is known exactly. alpha: 1/s, gain of
    the tracking law (eq. 11), by which the controller resists the recoil; 0 keeps torques constant, for other
    simulations and if the robot's tick is longer than a step of the model, and thus as long as a contact.
    """

    def __init__(
        self,
        config: RobotConfig,
        ball: str,
        alpha: float = 0.0,
    ) -> None:
        self.law = ContactLaw(0.0, 0.0)
        self.phases: tuple[float, ...] = (0.25, 0.75)
        self._model = model = config.load_model()
        self._alpha = alpha if config.tick < 1.5 * model.opt.timestep else 0.0
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
        self._data = mujoco.MjData(model)
        self._pose = config.pose_at_home
        joints = joint_ids(model, config.joint_names)
        self._qpos, self._dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        body = model.body(ball).id
        first = int(model.body_jntadr[body])
        free = model.jnt_type[first] == int(mujoco.mjtJoint.mjJNT_FREE)
        self._origin = np.zeros(3) if free else model.body_pos[body].copy()
        self._ball_qpos = slice(int(model.jnt_qposadr[first]), int(model.jnt_qposadr[first]) + 3)
        self._ball_dofs = slice(int(model.jnt_dofadr[first]), int(model.jnt_dofadr[first]) + 3)
        first_geom, geoms = int(model.body_geomadr[body]), int(model.body_geomnum[body])
        self._geoms = frozenset(range(first_geom, first_geom + geoms))
        self._masses, self._square = np.zeros((model.nv, model.nv)), np.ix_(self._dofs, self._dofs)
        self._mass = float(model.body_mass[body])

    def __call__(self, choice: Choice) -> np.ndarray:
        """Return the difference (3,), m/s, of the velocity after a hit from the law's; 0 if the racket is missed.

        A difference of the ball's position after the contact is included, divided by the flight time.
        """
        step = self._model.opt.timestep
        law = self.law
        expected = law.outgoing(self._mass, *choice.contact)[0]
        from_here = choice.ball + (choice.incoming - expected) * law.duration / 2
        found = []
        for phase in self.phases or ((choice.time / step) % 1.0,):
            touch = self.hit(choice, phase)
            if touch is not None:
                found.append(touch.velocity - expected + (touch.position - from_here) / choice.flight_time)
        return np.mean(found, axis=0) if found else np.zeros(3)

    def hit(self, choice: Choice, phase: float) -> Touch | None:
        """Simulate a hit with its touch `phase` of a step after the begin of the first; None if it misses."""
        model, data, step = self._model, self._data, self._model.opt.timestep
        before = phase * step
        data.qpos[:], data.qvel[:], data.qacc_warmstart[:] = self._pose, 0.0, 0.0
        back = choice.goal_time - choice.time + before
        data.qpos[self._qpos] = choice.positions - back * choice.velocities
        data.qvel[self._dofs] = choice.velocities
        data.qpos[self._ball_qpos] = choice.ball - before * choice.incoming - self._origin
        data.qvel[self._ball_dofs] = choice.incoming
        mujoco.mj_forward(model, data)
        held = (data.qfrc_bias - data.qfrc_passive)[self._dofs]
        data.qfrc_applied[self._dofs] = held
        mujoco.mj_fullM(model, data, self._masses)
        masses, begin = self._masses[self._square], data.qpos[self._qpos].copy()
        began, still = False, np.zeros(len(held))
        for count in range(1, int(LONGEST_S / step) + 1):
            speeds = data.qvel[self._dofs]
            if self._alpha:
                reference = begin + (count - 1) * step * choice.velocities, choice.velocities, still
                pull = tracking_acceleration(self._alpha, reference, data.qpos[self._qpos], speeds)
                data.qfrc_applied[self._dofs] = held + masses @ pull
            mujoco.mj_step(model, data)
            if self._alpha:  # As services.sim: exact for an acceleration that is constant over the step.
                data.qpos[self._qpos] -= step / 2 * (data.qvel[self._dofs] - speeds)
            touching = not self._geoms.isdisjoint(data.contact.geom.ravel().tolist())
            if began and not touching:
                return self._touch(count * step - before)
            began = began or touching
        return None

    def _touch(self, after: float) -> Touch:
        """Return the ball's present state extrapolated back by `after` (s)."""
        gravity = np.array([0.0, 0.0, -GRAVITY])
        velocity = self._data.qvel[self._ball_dofs] - gravity * after
        position = self._data.qpos[self._ball_qpos] + self._origin
        # Contacts are detected at the begin of a step, so the ball has been free for 0.5 to 1.5 steps.
        duration = max(after - 1.5 * self._model.opt.timestep, 0.0)
        at_touch = position - velocity * after - gravity * after**2 / 2
        return Touch(at_touch, velocity, duration, self._data.qvel[self._dofs])
