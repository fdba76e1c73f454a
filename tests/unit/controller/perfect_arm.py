"""An arm that follows every command exactly, and a trajectory for it."""

import msgspec
import numpy as np
import pytest

from motion.braking import stop
from motion.trajectory import Samples
from protocol import messages as m
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from robot.description import load_robot
from services.controller.checks import check_trajectory
from services.controller.core import Controller

ROBOT = load_robot()
JOINTS, TICK = ROBOT.joint_count, ROBOT.tick


class PerfectArm:
    """An arm that integrates the commanded acceleration exactly; a test sets `brake` and noise."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.tick = 0
        self.run = 1
        self.brake = False
        self.clients: set[str] = set()
        self.positions, self.velocities = ROBOT.home.copy(), np.zeros(JOINTS)
        self.accelerations = np.zeros(JOINTS)
        self.commands: list[m.Command] = []

    def state(self, **changes: object) -> m.State:
        """Return the state of the arm."""
        state = m.State(
            run=self.run, tick=self.tick, time=self.tick * TICK, positions=self.positions.tolist(),
            velocities=self.velocities.tolist(), torques=[0.0] * JOINTS, saturated=[False] * JOINTS,
            brake=self.brake, applied_tick=self.tick - 1, accelerations=self.accelerations.tolist(),
        )  # fmt: skip
        return msgspec.structs.replace(state, **changes)

    def turn(self, ticks: int) -> None:
        """For each tick, answer the state and move."""
        for _ in range(ticks):
            command = self.controller.answer(self.state(), now_ns=self.tick)
            assert command is not None
            self.commands.append(command)
            self.accelerations = np.array(command.accelerations)
            self.positions = self.positions + TICK * (self.velocities + TICK / 2 * self.accelerations)
            self.velocities = self.velocities + TICK * self.accelerations
            self.tick += 1


def trajectory(controller: Controller, start: int, goal_id: str = "goal", **fields: object) -> m.Trajectory:
    """Return a push of 10 rad/s² on the first joint for 200 ticks with soft ends, the hit at 200, and a stop.

    It begins at tick `start`, at which the reference must rest.
    """
    lead = max(0.0, start * TICK - controller.status().time)
    reference = controller.reference(m.ReferenceRequest(lead=lead))
    origin = np.array(reference.positions)
    shape = np.clip(np.minimum(np.arange(201), 200 - np.arange(201)) / 20.0, 0.0, 1.0)
    accelerations = np.zeros((201, JOINTS))
    accelerations[:, 0] = 10.0 * shape
    velocities = np.cumsum(np.vstack([np.zeros(JOINTS), (accelerations[1:] + accelerations[:-1]) / 2]), axis=0) * TICK
    steps = TICK * velocities[:-1] + TICK**2 * (accelerations[:-1] / 3 + accelerations[1:] / 6)
    positions = origin + np.vstack([np.zeros(JOINTS), np.cumsum(steps, axis=0)])
    halt = stop(positions[-1], velocities[-1], accelerations[-1], ROBOT.limits)
    tail = halt.sample(np.arange(1, int(np.ceil(halt.duration / TICK)) + 1) * TICK)
    samples = Samples(
        np.vstack([positions, tail.positions]),
        np.vstack([velocities, tail.velocities]),
        np.vstack([accelerations, tail.accelerations]),
    )
    made = m.Trajectory(
        goal_id=goal_id, epoch=controller.epoch, joint_names=list(ROBOT.joint_names), start_time=start * TICK,
        dt=TICK, count=len(samples), hit_index=200, positions=matrix_bytes(samples.positions),
        velocities=matrix_bytes(samples.velocities), accelerations=matrix_bytes(samples.accelerations),
        stamps=m.Stamps(requested=1, planned=2),
    )  # fmt: skip
    return msgspec.structs.replace(made, **fields)


def execute(arm: PerfectArm, message: m.Trajectory) -> m.Accepted:
    """Check a trajectory and splice it."""
    return arm.controller.execute(check_trajectory(message, ROBOT), arm.clients, now_ns=3)


def refused(arm: PerfectArm, message: m.Trajectory) -> Refusal:
    """Execute a trajectory that must be refused, and check that nothing changes."""
    before = arm.controller.epoch, arm.controller.mode, len(arm.controller.ledger.active)
    with pytest.raises(Refusal) as caught:
        execute(arm, message)
    assert before == (arm.controller.epoch, arm.controller.mode, len(arm.controller.ledger.active))
    return caught.value
