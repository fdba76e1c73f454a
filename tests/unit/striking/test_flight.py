import mujoco
import numpy as np
import pytest

from robot.striking.flight import Air, Ball, Net, aim, fly, landing_gradient, net_clearance, travel

STEP = 0.002
AIRS = {"vacuum": Air(), "wind": Air(wind=np.array([0.0, 1.0, 0.0])), "drag": Air(drag=0.02)}


def test_a_flight_without_drag_agrees_with_mujoco():
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP}"/><worldbody><body pos="0 0 2"><freejoint/><geom size=".03" mass=".1"/>'
        "</body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    data.qvel[:3] = 2.5, -1.0, 3.0
    mujoco.mj_step(model, data, 300)
    ball = Ball(0.1, 0.03, step=STEP)
    position, velocity = fly(ball, Air(), np.array([0, 0, 2.0]), np.array([2.5, -1.0, 3.0]), 300 * STEP)
    assert position == pytest.approx(data.qpos[:3], abs=1e-9)
    assert velocity == pytest.approx(data.qvel[:3], abs=1e-9)
    continuous, _ = fly(Ball(0.1, 0.03), Air(), np.array([0, 0, 2.0]), np.array([2.5, -1.0, 3.0]), 300 * STEP)
    assert abs(continuous[2] - data.qpos[2]) > 0.005


@pytest.mark.parametrize("air", [Air(drag=0.05), Air(drag=0.03, spin=np.array([0.0, 100.0, 0.0]))])
def test_coarse_steps_agree_with_fine_integration_of_drag_and_spin(air: Air):
    ball = Ball(0.057, 0.033, magnus=0.005, step=0.001)
    position, velocity = np.zeros(3), np.array([8.0, 1.0, 4.0])
    for _ in range(600):
        a = np.array([0, 0, -9.81]) - air.drag * np.linalg.norm(velocity) * velocity
        velocity = velocity + (a + ball.magnus * np.cross(air.spin, velocity)) * ball.step
        position = position + velocity * ball.step
    found, _ = travel(ball, air, np.zeros(3), np.array([8.0, 1.0, 4.0]), np.array(0.6), steps=60)
    assert found == pytest.approx(position, abs=2e-3)


@pytest.mark.parametrize("air", AIRS.values(), ids=AIRS)
def test_an_aimed_ball_lands_on_its_target(air: Air):
    ball, starts = Ball(0.1, 0.025, step=STEP), np.array([[1.5, 0.2, 1.2], [1.2, -0.4, 1.6]])
    times, target = np.array([0.5, 0.7]), np.array([-0.5, 0.3, 0.795])
    incoming, contact = np.array([[3.0, 0.0, -1.0], [4.0, 1.0, 0.5]]), 0.006
    velocities, leaves, arrivals = aim(ball, air, starts, target, times, incoming, contact)
    assert leaves == pytest.approx(starts + (incoming - velocities) * contact / 2)
    reached, speeds = travel(ball, air, leaves, velocities, times, steps=20)
    assert reached == pytest.approx(np.tile(target, (2, 1)), abs=1e-3)
    assert arrivals == pytest.approx(speeds, abs=5e-3)


def test_the_landing_gradient_agrees_with_finite_differences():
    ball, air, start = Ball(0.1, 0.025), Air(), np.array([[1.5, 0.2, 1.2]])
    time = np.array([0.6])
    velocity, _, arrival = aim(ball, air, start, np.array([-0.5, 0.3, 0.8]), time)
    slope = landing_gradient(velocity, arrival, time)[0]
    for k in range(3):
        pushed = velocity[0] + 1e-5 * np.eye(3)[k]
        fall = np.roots([-9.81 / 2, pushed[2], start[0, 2] - 0.8]).max()
        landed = start[0, :2] + pushed[:2] * fall
        assert (landed - [-0.5, 0.3]) / 1e-5 == pytest.approx(slope[:, k], abs=1e-3)


def test_the_clearance_above_the_net_is_measured_where_the_ball_crosses_it():
    net = Net(np.array([0.0, 0.0, 0.9]), np.array([1.0, 0.0]), 0.9)
    ball, starts = Ball(0.1, 0.025), np.array([[1.0, 0.0, 1.2], [1.0, 3.0, 1.2], [-0.1, 0.0, 1.2]])
    velocities = np.tile([-2.0, 0.0, 1.0], (3, 1))
    found = net_clearance(ball, Air(), net, starts, velocities, np.ones(3))
    assert found[0] == pytest.approx(1.2 + 0.5 - 9.81 / 8 - 0.025 - 0.9, abs=1e-6)
    assert np.isinf(found[1:]).all()
