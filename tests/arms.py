"""Robots with models of other projects, and the TOML fields that they need."""

from dataclasses import dataclass
from pathlib import Path

from tests import models


@dataclass(frozen=True, slots=True)
class Arm:
    """A model, the site of its tool, its joints and its home pose (rad)."""

    model: Path
    tool: str
    joints: tuple[str, ...]
    home: tuple[float, ...]
    rate_hz: int = 1000

    def write(self, folder: Path, name: str = "other") -> Path:
        """Write the robot's TOML, with the same limits for all joints, and return its path."""
        count = len(self.joints)
        file = folder / f"{name}.toml"
        file.write_text(
            f'name = "{name}"\nmodel = "{self.model}"\ntool = "{self.tool}"\nrate_hz = {self.rate_hz}\nalpha = 50.0\n'
            "silence_ticks = 20\nmax_tracking_error = 0.3\n[joints]\n"
            f"names = {list(self.joints)}\nhome = {list(self.home)}\nvelocities = {[3.0] * count}\n"
            f"accelerations = {[20.0] * count}\njerks = {[500.0] * count}\n"
        )
        return file


_UR = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_SEVEN = tuple(f"joint{index}" for index in range(1, 8))

UR5E = Arm(
    models.UR5E, "attachment_site", tuple(f"{joint}_joint" for joint in _UR), (-1.57, -1.57, 1.57, -1.57, -1.57, 0.0)
)
PANDA = Arm(models.PANDA, "TCP", _SEVEN, (0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.78))
IIWA14 = Arm(models.IIWA14, "TCP", _SEVEN, (0.0, 0.5, 0.0, -1.5, 0.0, 1.0, 0.0))
SO101 = Arm(
    models.SO101,
    "gripperframe",
    ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"),
    (0.0, -0.5, 0.5, 0.5, 0.0),
)
