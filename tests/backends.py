"""The robots that the contract tests run against, by name: add yours here."""

import sys
from collections.abc import Callable
from pathlib import Path

from examples.stand_in_driver import StandIn
from robot.description import RobotConfig
from services.common.robot_side.backend import Backend
from services.sim.arm import SimulatedArm

ROOT = Path(__file__).resolve().parents[1]

BACKENDS: dict[str, Callable[[RobotConfig], Backend]] = {"sim": SimulatedArm, "stand-in": StandIn}
"""Makes each robot from its description."""

COMMANDS: dict[str, list[str]] = {
    "sim": [sys.executable, "-m", "services.sim"],
    "stand-in": [sys.executable, str(ROOT / "examples" / "stand_in_driver.py")],
}
"""Starts each robot's process."""
