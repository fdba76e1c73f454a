"""The scene of a robot's model: entity names, moving bodies, camera, meshes and planes."""

from typing import Any

import numpy as np
import pytest
import rerun as rr
from setpoints import accelerating

from robot.description import RobotConfig, load_robot
from robot.shipped import DEFAULT_ROBOT_CONFIG
from services.recorder.geometry import Geometry
from services.recorder.scene import Scene
from services.sim.arm import SimulatedArm
from tests.arms import Arm

MJCF = """
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  0.2 0 0  0 0.1 0  0 0 0.3"/></asset>
  <worldbody>
    <geom type="plane" size="0 0 1" euler="20 0 0" pos="0 0 -0.1"/>
    <body pos="2 0 0">
      <geom type="box" size="0.1 0.1 0.1"/>
      <body pos="0 0 0.2">
        <joint name="a" axis="0 0 1"/>
        <geom type="capsule" size="0.05" fromto="0 0 0 0.4 0 0.2"/>
        <body name="fore/arm" pos="0.4 0 0.2">
          <joint name="b" axis="0 1 0"/>
          <geom type="capsule" size="0.04" fromto="0 0 0 0.4 0 0"/>
          <site name="tip" pos="0.4 0 0"/>
          <body name="jaw" pos="0.4 0 0">
            <joint name="finger" type="slide" axis="0 1 0" range="0 0.04"/>
            <geom type="box" size="0.05 0.01 0.02" mass="0.05"/>
          </body>
        </body>
      </body>
    </body>
    <body name="plan" pos="0.7 0.5 0.8"><freejoint name="block"/><geom type="mesh" mesh="wedge" mass="0.3"/></body>
    <body name="ball" pos="0 0 3"><freejoint/><geom type="sphere" size="0.03"/></body>
  </worldbody>
  <actuator><motor joint="a" ctrlrange="-80 80"/><motor joint="b" ctrlrange="-80 80"/></actuator>
</mujoco>
"""


def numbers_of(batch: Any) -> np.ndarray:
    """Return a batch of Rerun components as an array."""
    return np.array(batch.as_arrow_array().to_pylist())


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> RobotConfig:
    folder = tmp_path_factory.mktemp("odd")
    (folder / "odd.xml").write_text(MJCF)
    return load_robot(Arm(folder / "odd.xml", "tip", ("a", "b"), (0.0, 0.0), rate_hz=500).write(folder, "odd"))


def test_every_body_has_a_unique_path(config: RobotConfig):
    scene = Scene(config)
    assert scene.names == ["world", "body_1", "body_2", "fore\\/arm", "jaw", "plan_5", "ball"]
    assert [scene.names[body] for body in scene.arm] == ["body_2", "fore\\/arm", "jaw"]
    assert [scene.names[body] for body in scene.others] == ["plan_5"]


def test_held_joints_have_their_values_at_the_time_of_the_arms_pose(config: RobotConfig):
    scene = Scene(config)
    scene.expect([(0.1, {"finger": [0.01]}), (0.3, {"finger": [0.04], "absent": [1.0], "block": [0.0]})])
    places, _, _ = scene.body_poses(np.zeros((4, 2)), np.array([0.0, 0.1, 0.2, 0.3]))
    np.testing.assert_allclose(places[:, scene.arm.index(4), 1], [0.0, 0.01, 0.01, 0.04])


def test_joints_of_an_earlier_run_do_not_delay_those_of_the_next(config: RobotConfig):
    """The states at the end of a run may be lost, and the clock of the next run begins at 0."""
    scene = Scene(config)
    scene.expect([(100.0, {"finger": [0.01]})])
    scene.body_poses(np.zeros((1, 2)), np.array([99.9]))
    scene.expect([(0.1, {"finger": [0.04]})])
    places, _, _ = scene.body_poses(np.zeros((1, 2)), np.array([0.1]))
    assert places[0, scene.arm.index(4), 1] == pytest.approx(0.04)


def test_a_free_body_is_drawn_where_it_moves(config: RobotConfig):
    scene, arm = Scene(config), SimulatedArm(config)
    before = arm.surroundings()
    assert before["block"] == pytest.approx([0.7, 0.5, 0.8, 1, 0, 0, 0])
    assert set(before) == {"block", "finger"}
    for _ in range(50):
        arm.step(accelerating(np.zeros(2)))
    fallen = arm.surroundings()["block"]
    assert fallen[2] == pytest.approx(0.8 - 9.81 * 0.1**2 / 2, abs=2e-3)
    places, turns = scene.other_poses({"block": [*fallen[:3], 0, 1, 0, 0]})
    assert places[0] == pytest.approx(fallen[:3])
    assert turns[0].tolist() == [1, 0, 0, 0]  # Rerun's order: x, y, z, w


def test_the_camera_is_centred_on_an_arm_away_from_the_origin(config: RobotConfig):
    view = Scene(config).view()
    assert view.centre == pytest.approx([2.4, 0, 0.17], abs=0.05)
    assert 0.45 < view.radius < 0.6


def test_the_camera_is_centred_on_all_arms_of_a_scene():
    view = Scene(load_robot(DEFAULT_ROBOT_CONFIG.with_name("near.toml"))).view()
    assert view.centre[:2] == pytest.approx([0, 0], abs=0.01)
    assert view.radius > 2.1


def test_a_tilted_plane_is_drawn_as_a_tilted_slab_below_the_arm(config: RobotConfig):
    model, centre = config.load_model(visual=True), np.array([2.0, 0.0, 0.0])
    (slab,) = dict(Geometry(model, centre, 0.9).shapes(0))["plane"]
    assert isinstance(slab, rr.Boxes3D)
    assert numbers_of(slab.quaternions)[0] == pytest.approx([np.sin(np.pi / 18), 0, 0, np.cos(np.pi / 18)])
    x, y, z = numbers_of(slab.centers)[0]
    assert x == pytest.approx(2.0)
    assert z + 0.1 == pytest.approx(np.tan(np.pi / 9) * y, abs=0.004)  # in the plane, except for the slab's thickness
    assert numbers_of(slab.half_sizes)[0] == pytest.approx([0.9, 0.9, 0.002])


def test_vertices_and_normals_of_a_mesh_are_the_models(config: RobotConfig):
    model = config.load_model(visual=True)
    shape, _ = dict(Geometry(model, np.zeros(3), 1.0).shapes(5))[f"mesh_{model.body_geomadr[5]}"]
    assert isinstance(shape, rr.Mesh3D)
    faces = numbers_of(shape.triangle_indices)
    np.testing.assert_array_equal(numbers_of(shape.vertex_positions)[faces], model.mesh_vert[model.mesh_face])
    np.testing.assert_array_equal(numbers_of(shape.vertex_normals)[faces], model.mesh_normal[model.mesh_facenormal])
