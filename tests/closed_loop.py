"""The simulated arm and the controller in one process, without a bus: exact, and not bound to the wall clock."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from protocol import messages as m
from protocol.codec import matrix_bytes
from robot.description import RobotConfig, load_robot
from services.common.robot_side.drive import Drive
from services.common.robot_side.messages import state_message
from services.controller.checks import check_trajectory
from services.controller.core import Controller
from services.controller.incidents import touch_of
from services.sim.arm import SimulatedArm

TOML = """
name = "arm"
model = "{model}"
tool = {tool}
rate_hz = 1000
alpha = 50.0
silence_ticks = 20
{more}
[joints]
names = [{names}]
home = {home}
velocities = [{velocities}]
accelerations = [{accelerations}]
jerks = [{jerks}]
"""


def write_robot(folder: Path, model: Path, tool: str, names: list[str], home: object, more: str = "") -> RobotConfig:
    """Return the robot of a model whose joints all allow 3.15 rad/s, 20 rad/s² and 1000 rad/s³."""
    limits = {"velocities": 3.15, "accelerations": 20.0, "jerks": 1000.0}
    lists = {name: ", ".join([str(limit)] * len(names)) for name, limit in limits.items()}
    listed = ", ".join(f'"{name}"' for name in names)
    path = folder / "arm.toml"
    if "max_tracking_error" not in more:
        more = f"max_tracking_error = 0.3\n{more}"
    path.write_text(TOML.format(model=model, tool=tool, names=listed, home=home, more=more, **lists))
    return load_robot(path)


class ClosedLoop:
    """A simulated arm under control; one turn is one tick."""

    def __init__(
        self, config: RobotConfig, ball: m.Ball | None = None, positions: Sequence[float] | None = None
    ) -> None:
        """Start with the arm at `positions`, rad, or at home; the ball is as given, or on its tee."""
        self.config = config
        self.arm = SimulatedArm(config)
        self.arm.reset(None if positions is None else list(positions), ball=ball)
        self.controller = Controller(config)
        self.drive = Drive(config)
        self.contacts: list[m.Contact] = []
        self.torques: list[np.ndarray] = []
        """Torques of each tick, (J,), N·m."""
        self.accelerations: list[list[float]] = []
        """Commanded at each tick, (J,), rad/s²."""
        self.turn(10)

    def turn(self, ticks: int) -> None:
        """For each tick, answer the state, step the arm, and pass on contacts."""
        for _ in range(ticks):
            now = self.arm.observe()
            command = self.controller.answer(state_message(now, self.drive, now.tick - 1), now_ns=now.tick)
            assert command is not None
            self.accelerations.append(command.accelerations)
            self.drive.take(command, now.tick)
            self.arm.step(self.drive.setpoint(now.positions, now.velocities))
            self.torques.append(self.arm.observe().torques)
            for contact in self.arm.contacts():
                self.contacts.append(contact)
                if touch := touch_of(contact, self.config):
                    self.controller.ledger.note_touch(touch, round(contact.time * self.config.rate_hz))

    def move(self, change: dict[str, float], seconds: float, **fields: object) -> m.Result:
        """Play a smooth motion of the named joints by `change` (rad); its result is filled in as it is played.

        The hit is in the middle, where the arm is fastest.
        """
        ticks = round(seconds * self.config.rate_hz)
        share = np.linspace(0.0, 1.0, ticks + 1)[:, None]
        change_of = np.array([change.get(name, 0.0) for name in self.config.joint_names])
        turn = 2 * np.pi * share
        now = self.controller.reference(m.ReferenceRequest(lead=0.01))
        motion = m.Trajectory(
            goal_id=f"goal-{now.epoch}",
            epoch=now.epoch,
            joint_names=list(self.config.joint_names),
            start_time=now.time,
            dt=self.config.tick,
            count=ticks + 1,
            positions=matrix_bytes(np.array(now.positions) + change_of * (share - np.sin(turn) / (2 * np.pi))),
            velocities=matrix_bytes(_at_rest(change_of / seconds * (1 - np.cos(turn)))),
            accelerations=matrix_bytes(_at_rest(change_of / seconds**2 * 2 * np.pi * np.sin(turn))),
            **{"hit_index": ticks // 2, **fields},  # type: ignore[arg-type]
        )
        self.controller.execute(check_trajectory(motion, self.config), (), now_ns=0)
        return self.controller.ledger.result(motion.goal_id)


def _at_rest(samples: np.ndarray) -> np.ndarray:
    samples[-1] = 0.0
    return samples
