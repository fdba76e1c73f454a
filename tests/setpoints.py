"""Setpoints for tests."""

import numpy as np

from services.common.robot_side.backend import Setpoint


def accelerating(accelerations: np.ndarray) -> Setpoint:
    """Return a setpoint of accelerations (J,), rad/s², for a backend that uses nothing else."""
    return Setpoint(accelerations, accelerations, accelerations, accelerations)
