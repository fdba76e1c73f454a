"""Joints that another robot's states lead: that robot stands in this model, and its own sim moves it."""

from collections.abc import Sequence

import numpy as np

from services.sim.model import Scene


class LedJoints:
    """Puts joints where their own robot has them, once a tick. They push this arm, and it cannot push them."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._newest: dict[tuple[str, ...], tuple[np.ndarray, np.ndarray]] = {}
        self._addresses: dict[tuple[str, ...], tuple[np.ndarray, np.ndarray]] = {}

    def lead(
        self, joints: tuple[str, ...], positions: Sequence[float], velocities: Sequence[float]
    ) -> np.ndarray | None:
        """Take the newest positions and velocities of joints, rad and rad/s.

        Returns the addresses of their velocities where it is the first time.
        """
        first = joints not in self._addresses
        if first:
            model = self._scene.model
            ids = [model.joint(name).id for name in joints]
            self._addresses[joints] = model.jnt_qposadr[ids].astype(np.intp), model.jnt_dofadr[ids].astype(np.intp)
        self._newest[joints] = np.array(positions), np.array(velocities)
        return self._addresses[joints][1] if first else None

    def place(self) -> None:
        """Put the joints there; where nothing new has come since the last tick they stand still."""
        data = self._scene.data
        for joints, (positions, velocities) in self._newest.items():
            qpos, dofs = self._addresses[joints]
            data.qpos[qpos] = positions
            data.qvel[dofs] = velocities
            velocities[:] = 0.0
