"""`volley drag` without its window: forces on the mirrored model become torques on the arm."""

import mujoco
import numpy as np
import pytest

from protocol import messages as m
from robot.description import load_robot
from services.common.robot_side.backend import Setpoint
from services.sim.arm import SimulatedArm
from tools.shell.__main__ import main
from tools.shell.dragging import Mirror

CONFIG = load_robot()
FRAME = 25
"""Ticks between two frames of the viewer."""


def state(arm: SimulatedArm) -> m.State:
    """Return the arm's state message."""
    now = arm.observe()
    return m.State(
        run=0,
        tick=now.tick,
        time=now.time,
        positions=now.positions.tolist(),
        velocities=now.velocities.tolist(),
        torques=now.torques.tolist(),
        saturated=now.saturated.tolist(),
        brake=False,
        applied_tick=-1,
    )


def hold(mirror: Mirror, link: str) -> mujoco.MjvPerturb:
    """Return a perturbation that pulls a link at its centre of mass, as the viewer makes it."""
    grip = mujoco.MjvPerturb()
    grip.active, grip.select = int(mujoco.mjtPertBit.mjPERT_TRANSLATE), mirror.model.body(link).id
    grip.localmass = 1.0
    grip.refselpos = mirror.data.xipos[grip.select]
    grip.localpos = mirror.model.body_ipos[grip.select]
    return grip


def test_a_guided_arm_follows_the_mouse_and_comes_to_rest():
    arm, mirror = SimulatedArm(CONFIG), Mirror(CONFIG)
    arm.guide()
    ignored = Setpoint(*np.zeros((4, CONFIG.joint_count)))
    mirror.place(state(arm))
    grip = hold(mirror, "forearm")
    wanted = mirror.data.xipos[grip.select] + [0.0, 0.1, 0.1]
    grip.refselpos = wanted
    for _ in range(160):
        mirror.place(state(arm))
        mujoco.mjv_applyPerturbForce(mirror.model, mirror.data, grip)
        push = m.Disturb(kind="torque", values=mirror.torques().tolist(), duration=FRAME / CONFIG.rate_hz)
        arm.disturb(push)
        for _ in range(FRAME):
            arm.step(ignored)
    assert mirror.data.xipos[grip.select] == pytest.approx(wanted, abs=0.02)
    assert np.abs(arm.observe().velocities).max() < 0.05


def test_a_force_becomes_joint_torques_within_their_limits():
    mirror = Mirror(CONFIG)
    mujoco.mj_forward(mirror.model, mirror.data)
    body = mirror.model.body("forearm").id
    mirror.data.xfrc_applied[body, :3] = force = np.array([0.0, 20.0, 0.0])
    first = mirror.model.joint(CONFIG.joint_names[0]).id
    lever = mirror.data.xipos[body] - mirror.data.xanchor[first]
    assert mirror.torques()[0] == pytest.approx(np.cross(lever, force) @ mirror.data.xaxis[first])
    mirror.data.xfrc_applied[body, :3] *= 1000
    assert np.max(abs(mirror.torques()) / CONFIG.torques) == pytest.approx(1.0)


def test_without_a_display_drag_is_refused_in_a_sentence(monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert main(["drag"]) == 2
    assert "no window can be opened here: it needs a display" in capsys.readouterr().err
