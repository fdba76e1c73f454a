"""Torques from commanded accelerations, by inverse dynamics."""

import mujoco
import numpy as np

from services.sim.model import Scene


class InverseDynamics:
    """M·q̈ + bias − passive − friction, restricted to the joints at `dofs`: all others have no acceleration.

    Contacts are not compensated. It reads the scene's data after `mj_step1`.
    """

    def __init__(self, scene: Scene, dofs: np.ndarray) -> None:
        """Prepare for the joints at `dofs` (D,), addresses in MuJoCo's velocities."""
        self._scene = scene
        self._dofs = dofs
        self._accelerations = np.zeros(scene.model.nv)
        self._forces = np.zeros(scene.model.nv)
        rubbing = np.flatnonzero(scene.model.dof_frictionloss)
        self._rubbing = np.flatnonzero(np.isin(dofs, rubbing))
        self._rows = np.searchsorted(rubbing, dofs[self._rubbing])
        self._losses = scene.model.dof_frictionloss[dofs[self._rubbing]]

    def inertial(self, accelerations: np.ndarray) -> np.ndarray:
        """Return M·q̈ (D,), N·m, the generalised force that changes the accelerations by q̈ (D,), rad/s²."""
        scene = self._scene
        self._accelerations[self._dofs] = accelerations
        mujoco.mj_mulM(scene.model, scene.data, self._forces, self._accelerations)
        return self._forces[self._dofs]

    def free(self, forces: np.ndarray) -> np.ndarray:
        """Return M⁻¹·forces (n,), rad/s², the accelerations due to forces (n,), N·m, on the first n joints."""
        scene, on = self._scene, self._dofs[: len(forces)]
        applied = np.zeros((1, scene.model.nv))
        applied[0, on] = forces
        mujoco.mj_solveM(scene.model, scene.data, applied, applied.copy())
        return applied[0, on]

    def servo(self, accelerations: np.ndarray) -> np.ndarray:
        """Return forces (n,), N·m, on the last n joints that add q̈ (n,), rad/s², to them, with none on the rest."""
        scene, on = self._scene, self._dofs[-len(accelerations) :]
        mobility = np.zeros((len(on), scene.model.nv))
        mobility[np.arange(len(on)), on] = 1.0
        mujoco.mj_solveM(scene.model, scene.data, mobility, mobility.copy())
        return np.linalg.solve(mobility[:, on], accelerations)

    def torques(self, accelerations: np.ndarray) -> np.ndarray:
        """Return torques (D,), N·m, that accelerate the joints with q̈ (D,), rad/s², without contacts."""
        data, dofs = self._scene.data, self._dofs
        torques = self.inertial(accelerations) + data.qfrc_bias[dofs] - data.qfrc_passive[dofs]
        if len(self._rows):
            torques[self._rubbing] -= self._friction(accelerations[self._rubbing])
        return torques

    def _friction(self, accelerations: np.ndarray) -> np.ndarray:
        """Return the friction of the joints that have any, at their accelerations, N·m.

        MuJoCo's friction is a soft constraint, −D(q̈ − a) clipped at the friction loss; a opposes the velocity. It
        is smooth in the acceleration, so its compensation causes neither chattering nor stiction.
        """
        data = self._scene.data
        rows = data.ne + self._rows
        forces = data.efc_D[rows] * (data.efc_aref[rows] - accelerations)
        return np.minimum(np.maximum(forces, -self._losses), self._losses)
