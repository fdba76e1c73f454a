"""fancy_gym's `TableTennisEnv`, unmodified, and its arm as a robot of Volley's."""

import importlib
import sys
import types
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from robot.description import RobotConfig, load_robot
from robot.striking.arm import Racket
from robot.striking.flight import Ball, Court, Net, Surface

MODULE = "fancy_gym.envs.mujoco.table_tennis.table_tennis_env"
PACKAGES = ("fancy_gym", "fancy_gym.envs", "fancy_gym.envs.mujoco", "fancy_gym.envs.mujoco.table_tennis")
CONTROL_S = 0.008
"""The environment holds torques for four steps of 2 ms."""
OFFSET = 0.1
"""Height (m) of the ball's body above its slides, whose values the environment observes."""
FIRST_S = 0.1
"""Time of the first choice, s."""
GEARS = np.array([150.0, 125.0, 40.0, 60.0, 5.0, 5.0, 2.0])
TABLE, NET_TOP, NET_HALF_WIDTH = 0.77, 0.9225, 0.915
BALL = Ball(mass=0.1, radius=0.025, step=0.002)
RACKET = Racket(radius=0.075, thickness=0.005, two_sided=True)
BOUNCE = Surface(TABLE, restitution=0.9463, tangential=0.8517, dwell=0.00888)
"""Measured bounce of a ball of this environment on the table; balls always come from the same height."""

ROBOT = """
name = "wam"
model = "{model}"
rate_hz = 125
alpha = 50.0
silence_ticks = 20
max_tracking_error = 0.3
[tool]
body = "EE"
quaternion = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]  # z: the bat's normal
[collision]
ignore = []
[joints]
names = [
  "wam/base_yaw_joint_right", "wam/shoulder_pitch_joint_right", "wam/shoulder_yaw_joint_right",
  "wam/elbow_pitch_joint_right", "wam/wrist_yaw_joint_right", "wam/wrist_pitch_joint_right",
  "wam/palm_yaw_joint_right",
]
home = [0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 1.5]
velocities = {velocities}
accelerations = {accelerations}
jerks = {jerks}
"""
VELOCITIES = np.array([7.0, 7.0, 7.0, 7.0, 5.0, 7.0, 7.0])
ACCELERATIONS = np.array([45.0, 32.0, 45.0, 130.0, 50.0, 130.0, 200.0])
JERKS = ACCELERATIONS / 0.02
"""rad/s, rad/s², rad/s³. Velocities are those of the environment's own check, except for the fifth joint, whose damping
takes most of its torque at 7 rad/s. Accelerations are 80 % of what the motors can do in the worst of 4,000 postures."""


class NotInstalled(ImportError):
    """fancy_gym or gymnasium is missing."""


def environment(variant: str = "TableTennisEnv") -> Any:
    """Return the environment of this class, without the imports that its package needs for other environments.

    Raises:
        NotInstalled: a package is missing.
    """
    package = find_spec("fancy_gym")
    if package is None or not package.submodule_search_locations or find_spec("gymnasium") is None:
        sentence = "fancy_gym is missing: pip install 'volley[table-tennis]' && pip install --no-deps fancy-gym==0.3.0"
        raise NotInstalled(sentence)
    folder = Path(package.submodule_search_locations[0])
    for name in PACKAGES:
        if name not in sys.modules:
            # The package's own __init__ imports all its environments, and their packages.
            module = types.ModuleType(name)
            module.__path__ = [str(folder.joinpath(*name.split(".")[1:]))]
            module.__spec__ = ModuleSpec(name, None, is_package=True)
            module.__spec__.submodule_search_locations = module.__path__
            sys.modules[name] = module
    if "imageio" not in sys.modules and find_spec("imageio") is None:
        sys.modules["imageio"] = types.ModuleType("imageio")  # for videos, which are not recorded here
    return getattr(importlib.import_module(MODULE), variant)()


def was_hit(env: Any) -> bool:
    """Return whether the racket has met the ball, which the environment exposes only as a private attribute."""
    return env._hit_ball  # noqa: SLF001


def robot(folder: Path, scale: float = 1.0) -> RobotConfig:
    """Return the environment's arm with scaled limits; its description is written into `folder`."""
    path = folder / "wam.toml"
    path.write_text(toml(model_file(), scale))
    return load_robot(path)


def model_file() -> Path:
    """Return the environment's model. Raises NotInstalled."""
    environment().close()
    return Path(importlib.import_module(MODULE).__file__ or "").parent / "assets/xml/table_tennis_env.xml"


def toml(model: Path, scale: float = 1.0) -> str:
    """Return the description of the arm in a model, with scaled limits."""
    kinds = {"velocities": VELOCITIES, "accelerations": ACCELERATIONS, "jerks": JERKS}
    return ROBOT.format(model=model, **{name: (scale * values).tolist() for name, values in kinds.items()})


def court(restitution: float = 1.0) -> Court:
    """Return the table and its net. restitution: assumed one, relative to the true one."""
    net = Net(np.array([0.0, 0.0, NET_TOP]), np.array([1.0, 0.0]), NET_HALF_WIDTH)
    bounce = Surface(TABLE, restitution * BOUNCE.restitution, BOUNCE.tangential, BOUNCE.dwell)
    return Court(bounce, net)
