"""A model compiled without visual geoms has exactly the dynamics of the whole one."""

import mujoco
import numpy as np
import pytest

from robot.compilation import compile_spec
from robot.description import load_robot
from tests.models import FR3

DYNAMICS = (
    "body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat", "body_parentid", "dof_armature",
    "dof_damping", "dof_frictionloss", "jnt_pos", "jnt_axis", "jnt_range", "site_pos", "site_quat", "actuator_gear",
)  # fmt: skip

ALL_KINDS = """
<mujoco>
  <asset>
    <mesh name="wedge" vertex="0 0 0  0.2 0 0  0 0.1 0  0 0 0.3"/>
    <texture name="grid" type="2d" builtin="checker" width="64" height="64"/>
    <material name="painted" texture="grid"/>
  </asset>
  <worldbody>
    <body name="weighed">
      <joint name="a" axis="0 0 1"/>
      <geom name="shell" type="mesh" mesh="wedge" contype="0" conaffinity="0" material="painted"/>
      <geom name="hull" type="capsule" size="0.05 0.1" density="700"/>
      <site name="tip" pos="0.5 0.1 0"/>
      <body name="given" pos="0.3 0 0">
        <joint name="b" axis="0 1 0"/>
        <inertial mass="2" pos="0 0.1 0" diaginertia="0.01 0.02 0.02"/>
        <geom name="cover" type="mesh" mesh="wedge" contype="0" conaffinity="0"/>
        <geom name="paired" type="sphere" size="0.04" contype="0" conaffinity="0"/>
      </body>
    </body>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 -1"/>
  </worldbody>
  <contact><pair geom1="paired" geom2="floor"/></contact>
</mujoco>
"""


def collides(model: mujoco.MjModel) -> np.ndarray:
    return (model.geom_contype | model.geom_conaffinity) != 0


@pytest.mark.parametrize("source", [ALL_KINDS, pytest.param(FR3, id="fr3")])
def test_dynamics_are_the_same_without_visual_geoms(source):
    read = mujoco.MjSpec.from_string if isinstance(source, str) else lambda path: mujoco.MjSpec.from_file(str(path))
    whole, bare = compile_spec(read(source), visual=True), compile_spec(read(source))
    assert bare.ngeom < whole.ngeom
    assert bare.nmeshvert < whole.nmeshvert / 2
    for name in DYNAMICS:
        np.testing.assert_array_equal(getattr(bare, name), getattr(whole, name), err_msg=name)
    np.testing.assert_array_equal(bare.geom_size[collides(bare)], whole.geom_size[collides(whole)])


def test_only_geoms_without_collisions_are_left_out():
    bare = compile_spec(mujoco.MjSpec.from_string(ALL_KINDS))
    assert {bare.geom(i).name for i in range(bare.ngeom)} == {"hull", "paired", "floor"}
    assert (bare.nmesh, bare.ntex, bare.nmat) == (0, 0, 0)


def test_load_model_returns_an_independent_copy():
    robot = load_robot()
    robot.load_model().opt.timestep = 0.5
    assert robot.load_model().opt.timestep == robot.model.opt.timestep != 0.5
