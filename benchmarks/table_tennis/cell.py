"""The environment's arm as a robot of the services: its files, its backend, its loop."""

import logging
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from benchmarks.table_tennis.motors import Motors
from benchmarks.table_tennis.scene import BALL, BOUNCE, CONTROL_S, GEARS, OFFSET, environment, model_file, toml
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from robot.description import RobotConfig
from services.common.robot_side.backend import Backend, Observation, Setpoint
from services.common.robot_side.loop import RobotLoop

STRIKING = """
[ball]
drag = 0.0
magnus = 0.0
rate_hz = 125
[racket]
geom = "bat"
restitution = 0.99
friction = 0.86
[racket.recoil]
window = 0.15
positions = 0.5
velocities = 20.0
tolerance = 0.02
[court]
surface = "table_tennis_table"
net = "table_te_context_spacennis_net"
restitution = {restitution}
friction = {friction}
dwell = {dwell}
region = [[-1.37, 0.0], [-0.7625, 0.7625]]
"""

INERTIA = 10.0
"""kg·m²."""


def write_robot(folder: Path, restitution: float = 1.0) -> Path:
    """Write the files of the robot for the services, and return its TOML; the ball moves freely and is called `ball`.

    restitution: assumed restitution of the table, relative to the true one.
    """
    xml = model_file()
    spec = mujoco.MjSpec.from_file(str(xml))
    spec.meshdir = str((xml.parent / spec.meshdir).resolve())
    slides = spec.body("target_ball")
    geom = slides.first_geom()
    ball = spec.worldbody.add_body(name="ball", pos=[-1.0, 0.0, 1.85])
    ball.add_freejoint(name="ball")
    # The environment's ball slides without rotation; with this moment of inertia hits do not rotate it.
    ball.explicitinertial, ball.mass, ball.inertia, ball.ipos = True, BALL.mass, [INERTIA] * 3, [0.0] * 3
    shape = {
        name: getattr(geom, name) for name in ("type", "size", "condim", "friction", "solimp", "solref", "priority")
    }
    ball.add_geom(name="ball", **shape)
    spec.delete(slides)
    (folder / "scene.xml").write_text(spec.to_xml())
    path = folder / "wam.toml"
    bounce = {"restitution": restitution * BOUNCE.restitution, "friction": BOUNCE.tangential, "dwell": BOUNCE.dwell}
    path.write_text(toml(folder / "scene.xml") + STRIKING.format(**bounce))
    return path


class EnvironmentArm(Backend):
    """The arm of fancy_gym's environment. Its time advances while a ball flies; before, the arm rests at home."""

    def __init__(self, config: RobotConfig) -> None:
        self.env: Any = environment()
        self._motors = Motors(self.env, config.joint_names)
        self.begin_ball(0)

    def begin_ball(self, seed: int) -> None:
        """Begin the episode of a seed; the ball waits for `release`."""
        self._seen, _ = self.env.reset(seed=seed)
        self.flies, self.done = False, False
        self.info: dict[str, Any] = {}
        self._tick = 0
        self._torques = np.zeros(len(GEARS))
        self._now = self._measure()

    def begin_run(self) -> None:
        """Count ticks from 0; runs begin only by `begin_ball`."""

    def observe(self) -> Observation:
        """Return the arm at the present tick."""
        return self._now

    def step(self, setpoint: Setpoint) -> None:
        """Advance the environment by one step of 8 ms, if its ball flies."""
        if self.flies and not self.done:
            now = self._now
            planned = setpoint.velocities - setpoint.feedforward * CONTROL_S / 2
            action = self._motors.action(now.velocities, setpoint.accelerations, planned)
            self._seen, _, self.done, _, self.info = self.env.step(action)
            self._torques = action * GEARS
        self._tick += 1
        self._now = self._measure()

    @property
    def ball(self) -> np.ndarray:
        """The ball's position (3,), m, in the world."""
        return self._seen[14:17] + np.array([0.0, 0.0, OFFSET])

    @property
    def target(self) -> np.ndarray:
        """Target of the ball (2,), m."""
        return self._seen[-2:]

    def _measure(self) -> Observation:
        positions, velocities = self._seen[:7].copy(), self._seen[7:14].copy()
        saturated = np.abs(self._torques) >= GEARS
        time = self._tick * CONTROL_S
        return Observation(self._tick, time, positions, velocities, self._torques, saturated, positions, velocities)


class TableLoop(RobotLoop):
    """Keeps the pace, `slow` times slower than the wall clock while the ball flies, and publishes the ball."""

    def __init__(self, bus: Bus, config: RobotConfig, arm: EnvironmentArm, log: logging.Logger, slow: float) -> None:
        super().__init__(bus, config, arm, "paced", log)
        self.arm = arm
        self._ball = self.publisher(topics.BALL)
        self._slow = slow
        self._due = time.monotonic()
        self.behind_s = 0.0
        """Wall time by which ticks were late while balls flew, s."""
        self.commanded: list[bytes] = []
        """Commands of the ball that flies."""

    def begin_ball(self, seed: int) -> None:
        """Begin a run with the ball of a seed."""
        self.arm.begin_ball(seed)
        self.begin_run()
        self.commanded.clear()
        self.publish()

    def receive(self, data: bytes) -> None:
        """Process a command, and record it."""
        super().receive(data)
        self.commanded.append(data)

    def turn(self, noise: np.ndarray | None = None) -> None:
        """Wait for the controller and the wall clock, let a tick pass, and publish; `noise` (3,), m, of the sight."""
        while not self.is_answered(self.arm.observe().tick) and self.controller.is_awaited:
            taken = self.commands.take(0.02)
            if taken is not None:
                self.receive(taken)
            self.attend()
        flies = self.arm.flies and not self.arm.done
        tick_s = CONTROL_S * (self._slow if flies else 1.0)
        wait = self._due - time.monotonic()
        self.behind_s += max(0.0, -wait) if flies else 0.0
        time.sleep(max(0.0, wait))
        self._due = max(self._due, time.monotonic() - tick_s) + tick_s
        self.receive_all()
        self.step()
        self.publish()
        if flies and not self.arm.done and noise is not None:
            place = self.arm.ball + noise
            self._ball.put(m.BallState(time=self.arm.observe().time, position=place.tolist()))
        self.attend()
