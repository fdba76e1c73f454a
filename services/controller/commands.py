"""The command that answers a state: eq. 11 of the paper, around the reference trajectory."""

import numpy as np

from motion.tracking import returning_acceleration, tracking_acceleration
from protocol import messages as m
from robot.description import RobotConfig
from services.controller.timeline import Timeline


class CommandMaker:
    """Makes the command of each tick.

    Attributes:
        delay_ticks: Ticks from the answered state to the tick in which the arm applies the command.
    """

    def __init__(self, config: RobotConfig) -> None:
        self.delay_ticks = 0
        self._config = config
        self._acceleration = np.zeros(config.joint_count)

    def make(self, state: m.State, timeline: Timeline, goal_id: str | None, returning: bool) -> m.Command:
        """Return the command that answers `state`.

        goal_id: of the motion that is played. returning: whether the arm returns to the reference after a recoil.
        """
        config, reference = self._config, timeline.at(state.tick)
        # The command is held for a tick, so its feedforward is the reference's change of velocity over that tick.
        begin, end = (timeline.at(state.tick + self.delay_ticks + k) for k in (0, 1))
        feedforward = (end[1] - begin[1]) * config.rate_hz
        here = (reference[0], reference[1], feedforward), np.array(state.positions), np.array(state.velocities)
        if returning:
            accelerations = returning_acceleration(config.alpha, *here, config.limits, config.tick)
        else:
            accelerations = tracking_acceleration(config.alpha, *here, out=self._acceleration)
        return m.Command(
            run=state.run,
            tick=state.tick,
            source="controller",
            accelerations=accelerations.tolist(),
            positions=reference[0].tolist(),
            velocities=reference[1].tolist(),
            goal_id=goal_id,
            next=m.Point(positions=end[0].tolist(), velocities=end[1].tolist()),
            feedforward=feedforward.tolist(),
        )
