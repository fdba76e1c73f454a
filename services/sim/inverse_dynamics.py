"""Torque from commanded accelerations, by inverse dynamics."""

import mujoco
import numpy as np

from services.sim.model import Scene


class InverseDynamics:
    """M·q̈ + bias − passive over the arm's joints alone: what else moves is at rest in it.

    The ball's contacts are therefore not compensated. Reads the scene's data as `mj_step1` leaves them.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._accelerations = np.zeros(scene.model.nv)
        self._forces = np.zeros(scene.model.nv)

    def inertial(self, accelerations: np.ndarray) -> np.ndarray:
        """M·q̈ (J,), N·m: the generalised force that would change the accelerations by q̈ (J,), rad/s²."""
        scene = self._scene
        self._accelerations[scene.dofs] = accelerations
        mujoco.mj_mulM(scene.model, scene.data, self._forces, self._accelerations)
        return self._forces[scene.dofs]

    def torques(self, accelerations: np.ndarray) -> np.ndarray:
        """Torques (J,), N·m, that accelerate the arm with q̈ (J,), rad/s², where nothing touches it."""
        data, dofs = self._scene.data, self._scene.dofs
        return self.inertial(accelerations) + data.qfrc_bias[dofs] - data.qfrc_passive[dofs]
