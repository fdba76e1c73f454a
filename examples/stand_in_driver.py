"""A driver in sixty lines: an ideal arm that follows commands exactly, in place of the sim.

    python examples/stand_in_driver.py

It hosts the router on tcp/127.0.0.1:7447. Start `python -m services.planner` and `python -m services.controller` beside
it, and send goals as to any arm. To drive a real robot, implement the same methods with its interface. A robot with a
clock of its own declares the ability `own_clock` and waits in `step` for its next tick.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import tyro

from robot.description import RobotConfig
from services.common.cli import Common, Options
from services.common.robot_side.backend import Backend, Observation, Setpoint
from services.common.robot_side.loop import RobotLoop
from services.common.robot_side.process import run_robot


class StandIn(Backend):
    """An arm that integrates the commanded accelerations, without mass, friction or noise."""

    def __init__(self, config: RobotConfig) -> None:
        self._config = config
        self._positions, self._velocities = config.home, np.zeros(config.joint_count)
        self.begin_run()

    def observe(self) -> Observation:
        """Return the arm at the present tick."""
        return self._now

    def step(self, setpoint: Setpoint) -> None:
        """Hold the accelerations for a tick; the positions follow exactly."""
        tick, accelerations = self._config.tick, setpoint.accelerations
        self._positions = self._positions + self._velocities * tick + accelerations * (tick * tick / 2)
        self._velocities = self._velocities + accelerations * tick
        self._now = self._measure(self._now.tick + 1)

    def begin_run(self) -> None:
        """Count ticks from 0, at rest where the arm stands."""
        self._velocities = np.zeros(self._config.joint_count)
        self._now = self._measure(0)

    def _measure(self, tick: int) -> Observation:
        nothing = np.zeros(self._config.joint_count)
        time = tick / self._config.rate_hz
        return Observation(tick, time, self._positions, self._velocities, torques=nothing, saturated=nothing > 0)


@dataclass(frozen=True, slots=True)
class Flags:
    """Run an ideal arm that follows commands exactly, and host the router."""

    common: Common = field(default_factory=Options)
    clock: Literal["paced", "realtime"] = "paced"


if __name__ == "__main__":
    flags = tyro.cli(Flags)
    build = lambda bus, config, log: [RobotLoop(bus, config, StandIn(config), flags.clock, log)]  # noqa: E731
    raise SystemExit(run_robot("stand-in", flags.common, flags.clock, build))
