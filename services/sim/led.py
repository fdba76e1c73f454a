"""Joints of another robot in this model, which follow that robot's states; its own sim moves it."""

from collections.abc import Sequence

import numpy as np

from services.sim.model import Scene


class LedJoints:
    """Sets joints to the state of their own robot, once a tick. They can push this arm, but not the reverse."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._newest: dict[tuple[str, ...], tuple[np.ndarray, np.ndarray]] = {}
        self._addresses: dict[tuple[str, ...], tuple[np.ndarray, np.ndarray]] = {}

    def lead(
        self, joints: tuple[str, ...], positions: Sequence[float], velocities: Sequence[float]
    ) -> np.ndarray | None:
        """Store the newest positions and velocities of joints, rad and rad/s.

        Returns the addresses of their velocities on the first call for them.
        """
        first = joints not in self._addresses
        if first:
            model = self._scene.model
            ids = [model.joint(name).id for name in joints]
            self._addresses[joints] = model.jnt_qposadr[ids].astype(np.intp), model.jnt_dofadr[ids].astype(np.intp)
        self._newest[joints] = np.array(positions), np.array(velocities)
        return self._addresses[joints][1] if first else None

    def place(self) -> None:
        """Set the joints' positions and velocities; joints without a new state since the last tick stand still."""
        data = self._scene.data
        for joints, (positions, velocities) in self._newest.items():
            qpos, dofs = self._addresses[joints]
            data.qpos[qpos] = positions
            data.qvel[dofs] = velocities
            velocities[:] = 0.0
