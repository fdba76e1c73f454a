"""`volley drag`: a window in which the mouse drags a simulated arm."""

import time
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import glfw
import mujoco
import mujoco.viewer
import numpy as np
from tyro.conf import arg

from client import Stream
from protocol import messages as m
from protocol import topics
from robot.description import RobotConfig, RobotError, load_robot
from robot.model import joint_ids
from robot.shipped import DEFAULT_ROBOT_CONFIG
from robot.surroundings import Surroundings
from robot.tree import is_moved_by
from tools.shell.shell import Shared, Shell, UsageError, reach

HOW = "double-click a link, then hold Ctrl and drag it: with the right button to pull, with the left one to turn"
FRAME_S = 1 / 60
LONGEST_PUSH_S = 0.1
STIFFNESS = 50.0
"""Stiffness of the spring between mouse and link, 1/s²; at MuJoCo's 100 the delay from mouse to arm makes it swing."""


def drag(
    *,
    robot_config: Annotated[Path, arg(metavar="FILE", help_behavior_hint="")] = DEFAULT_ROBOT_CONFIG,
    shell: Shared,
) -> None:
    """Open MuJoCo's viewer, in which the mouse drags a simulated arm, until the window is closed.

    `volley teach NAME --drag` makes the arm compliant and records how it is dragged.

    Args:
        robot_config: TOML file of the arm; by default the shipped one.
        shell: How to reach the robot.
    """
    try:
        config = load_robot(robot_config)
    except RobotError as problem:
        raise UsageError(str(problem)) from None
    check_display()
    with reach(shell) as link:
        description = link.arm.description()
        if tuple(description.joint_names) != config.joint_names:
            names = ", ".join(description.joint_names)
            raise UsageError(f"{robot_config} is another arm: the robot has {names}; name its --robot-config")
        mirror = Mirror(config)
        viewer = mujoco.viewer.launch_passive(mirror.model, mirror.data, show_left_ui=False, show_right_ui=False)
        with link.arm.stream(topics.STATE, 1) as states, viewer:
            mirror.aim(viewer.cam)
            viewer.set_texts((None, mujoco.mjtGridPos.mjGRID_TOPLEFT, HOW, ""))
            print(HOW, flush=True)
            _follow(link, states, mirror, viewer)


def check_display() -> None:
    """Check that a window can be opened.

    Raises:
        UsageError: there is no display, or it cannot open an OpenGL window.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glfw.GLFWError)
        if glfw.init():
            glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
            trial = glfw.create_window(1, 1, "", None, None)
            glfw.default_window_hints()
            if trial:
                glfw.destroy_window(trial)
                return
    raise UsageError(
        "no window can be opened here: it needs a display with OpenGL ($DISPLAY or $WAYLAND_DISPLAY names it); "
        "push the arm with volley disturb instead"
    )


class Mirror:
    """A copy of the simulated arm: it follows the arm's states, and turns the mouse's forces into joint torques.

    Attributes:
        model: The arm's model, with its visual geometry.
        data: The pose that `place` set; `xfrc_applied` (bodies, 6) are the dragging forces, N and N·m.
    """

    def __init__(self, config: RobotConfig) -> None:
        self.model = config.load_model(visual=True)
        self.model.vis.map.stiffness = STIFFNESS
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = config.pose_at_home
        joints = joint_ids(self.model, config.joint_names)
        self._qpos, self._dofs = self.model.jnt_qposadr[joints], self.model.jnt_dofadr[joints]
        self._links = [body for body in range(1, self.model.nbody) if is_moved_by(self.model, body, set(joints))]
        self._surroundings = Surroundings(config, self.model)
        self._largest = config.torques

    def aim(self, camera: mujoco.MjvCamera) -> None:
        """Point a camera at the arm, from its side and slightly above."""
        mujoco.mj_kinematics(self.model, self.data)
        places = self.data.xpos[self._links]
        low, high = places.min(axis=0), places.max(axis=0)
        camera.lookat[:], camera.distance = (low + high) / 2, 2 * np.linalg.norm(high - low)
        camera.azimuth, camera.elevation = 130.0, -15.0

    def place(self, state: m.State) -> None:
        """Set the arm's joints and the held joints to the positions of a state."""
        self.data.qpos[self._qpos], self.data.qvel[self._dofs] = state.positions, state.velocities
        self._surroundings.place(self.data, {name: [value] for name, value in state.held.items()})
        mujoco.mj_forward(self.model, self.data)

    def torques(self) -> np.ndarray:
        """Return the joint torques (J,), N·m, of the dragging forces, scaled down to the motors' torque limits."""
        total = np.zeros(self.model.nv)
        for body in np.flatnonzero(self.data.xfrc_applied.any(axis=1)):
            force, torque = self.data.xfrc_applied[body].reshape(2, 3)
            mujoco.mj_applyFT(self.model, self.data, force, torque, self.data.xipos[body], body, total)
        torques = total[self._dofs]
        return torques / max(1.0, float(np.max(abs(torques) / self._largest)))


def _follow(link: Shell, states: Stream[m.State], mirror: Mirror, viewer: mujoco.viewer.Handle) -> None:
    """Draw the arm and push it, frame by frame; each push lasts as long as the last frame took."""
    shown = before = None
    while viewer.is_running():
        time.sleep(FRAME_S)
        with suppress(TimeoutError):  # a stepped clock sends states only with steps
            before, shown = shown, states.take(timeout=1.0)
            mirror.place(shown)
        viewer.sync()
        torques, took = mirror.torques(), shown.time - before.time if shown and before else 0.0
        if torques.any() and took > 0:
            link.arm.disturb("torque", values=torques, duration=min(took, LONGEST_PUSH_S))
