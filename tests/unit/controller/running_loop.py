"""A controller's loop on a fake bus, whose arm has described itself."""

import logging
from collections.abc import Callable
from typing import Any

from protocol import messages as m
from protocol import topics
from protocol.codec import encode
from robot.description import RobotConfig
from services.controller.loop import ControllerLoop
from tests.unit.controller.stand_ins import FakeBus, FakeClock, description

A_WAIT = 1.3
"""Ticks; longer than the controller waits for a state."""


class RunningLoop:
    """A loop whose arm has described itself."""

    def __init__(self, arm_clock: m.Clock, config: RobotConfig, clock: Callable[[], int] | None) -> None:
        self.bus, self.clock, self.config = FakeBus(), FakeClock(), config
        log = logging.getLogger("controller")
        self.loop = ControllerLoop(self.bus, config, log, clock or self.clock)  # type: ignore[arg-type]
        self.loop.open()
        self.bus.see_arm()
        self.loop.turn()
        self.bus.asked[-1][1](description(arm_clock, config))
        self.bus.streams["state"].wake()
        self.loop.turn()

    @property
    def answered(self) -> list[int]:
        """The ticks of all commands."""
        return [command.tick for command in self.bus.published["command"]]

    @property
    def fault(self) -> str | None:
        """The fault in the newest status."""
        statuses = self.bus.published["status"]
        return statuses[-1].fault if statuses else None

    def turn(self, *states: m.State | bytes) -> None:
        """Run the loop once, after these messages have arrived."""
        for each in states:
            self.bus.send(each if isinstance(each, bytes) else encode(each))
        self.loop.turn()

    def wait(self, *states: m.State | bytes) -> None:
        """Run the loop through one wait, in which these messages arrive."""
        self.clock.pass_by(A_WAIT * self.config.tick)
        self.turn(*states)

    def ask(self, topic: topics.Query, request: Any) -> Any:
        """Return the loop's answer to a request, before the next tick."""
        sent = self.bus.request(topic, request)
        while sent.answer is None:
            self.turn()
        return sent.answer

    def close(self) -> None:
        """End the loop and its thread at once."""
        self.clock.creep_ns = 1_000_000_000_000
        self.loop.close()
