"""Rallies of two arms on running services: serve, follow the ball, score."""

import contextlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig
from tools.rally.exchange import exchange, parked_ball, serve
from tools.rally.limit_monitor import LimitMonitor, LimitReport
from tools.rally.received import Messages, forbidden_contact
from tools.rally.referee import Referee

ARM_TOPICS = (topics.CONTACT, topics.ENDED, topics.STRIKES)
"""Topics that are followed for each arm, in its own time; the referee uses the first arm's ball and contacts."""
READY_S = 30.0
"""Longest wait for both arms to rest before the next serve, s of wall time."""
REST_S = 0.2
"""Rest before a serve, s of robot time."""


@dataclass(slots=True, eq=False)
class Rally:
    """One rally.

    Attributes:
        server: The arm from whose half the ball was served.
        strokes: Number of strokes that counted.
        over: Why the rally ended.
        duration: Robot time, s.
        incidents: A sentence for each motion that was aborted, and each contact without the ball.
        checked: Use of the limits by commands and states of each arm.
    """

    server: str
    strokes: int = 0
    over: str = ""
    duration: float = 0.0
    incidents: list[str] = field(default_factory=list)
    checked: dict[str, LimitReport] = field(default_factory=dict)

    def faults(self) -> list[str]:
        """Return a sentence for each incident, and for each arm that exceeded a limit."""
        beyond = [(name, report) for name, report in self.checked.items() if report.violations]
        return self.incidents + [
            f"{name}: {report.violations} ticks beyond a limit: {report.worst}" for name, report in beyond
        ]


class _RallyFollower:
    """Updates a rally from messages."""

    def __init__(self, rally: Rally, arms: Mapping[str, RobotConfig], served: float) -> None:
        """`served`: time at which the ball was thrown, s, on the clock of the first arm."""
        self._rally, self._arms, self._served = rally, arms, served
        self._first = next(iter(arms))
        self._reasons = dict.fromkeys(arms, "")
        receiver = next(name for name in arms if name != rally.server)
        self.referee = Referee(arms, receiver, served)
        self.touches: dict[str, list[float]] = {name: [] for name in arms}

    def take(self, name: str, message: Any) -> None:
        """Process a message about the arm `name`."""
        match message:
            case m.BallState():
                self.referee.add_sight(message)
                self._rally.duration = max(self._rally.duration, message.time - self._served)
            case m.Contact():
                self._touch(name, message)
            case m.Strike():
                self._reasons[name] = message.reason if message.phase in ("refused", "missed") else ""
            case m.Result() if message.outcome == "aborted":
                self._rally.incidents.append(f"{name}: goal {message.goal_id} was aborted: {message.reason}")
        self._rally.strokes = self.referee.strokes

    def end_reason(self) -> str:
        """Return why the rally has ended, with the strikers' last reasons."""
        if not self.referee.over:
            return "all strokes played"
        listed = "; ".join(f"{name}: {reason}" for name, reason in self._reasons.items() if reason)
        return f"{self.referee.over}{f' ({listed})' if listed else ''}"

    def _touch(self, name: str, contact: m.Contact) -> None:
        if self._arms[name].bodies.intersection(contact.bodies):
            self.touches[name].append(contact.time)
        if name != self._first:
            return
        self.referee.add_contact(contact)
        if sentence := forbidden_contact(contact):
            self._rally.incidents.append(sentence)


class RallyPlayer:
    """Plays rallies of two arms on their running services."""

    def __init__(
        self, buses: Mapping[str, Bus], configs: Mapping[str, RobotConfig], seed: int, max_strokes: int
    ) -> None:
        """`buses`, `configs`: bus and description of each arm, by name; `max_strokes`: largest number in a rally."""
        self._buses, self._configs, self._max_strokes = buses, configs, max_strokes
        self._random = np.random.default_rng(seed)
        self._first = next(iter(buses))
        of_arms = [(bus, topic) for bus in buses.values() for topic in ARM_TOPICS]
        self._messages = Messages([(buses[self._first], topics.BALL), *of_arms])
        self._watches = {name: LimitMonitor(bus, configs[name]) for name, bus in buses.items()}
        one, other = configs
        self._exchanges = {a: exchange(configs[a], configs[b]) for a, b in ((one, other), (other, one))}

    def begin(self, noise: m.Disturb | None, revise_hz: float) -> None:
        """Add noise to the cameras, and request strikes from both strikers."""
        for name, bus in self._buses.items():
            if noise is not None:
                bus.ask(topics.SIM_DISTURB, noise)
            play = self._exchanges[name]
            x, y, z = play.target.tolist()
            request = m.StrikeRequest(target=(x, y, z), flight_time=play.flight_time, revise_hz=revise_hz)
            bus.ask(topics.STRIKE, request)

    def play(self, server: str, counted: Callable[[int], object]) -> Rally:
        """Serve from the half of `server`, and follow the rally to its end; `counted` is called with each new count.

        Raises:
            Refusal: the ball cannot be served.
            NoAnswer: the sim does not reply.
        """
        self._buses[self._first].ask(topics.SIM_BALL, parked_ball(self._configs[self._first]))
        self._wait_for_rest()
        throw = serve(self._configs[server], self._exchanges[server], self._random)
        self._messages.waiting()  # discard the messages about the rally before
        for watch in self._watches.values():
            watch.drop()
        served = self._buses[self._first].ask(topics.SIM_BALL, throw).time
        rally = Rally(server)
        follower = _RallyFollower(rally, self._configs, served)
        while not follower.referee.over and rally.strokes < self._max_strokes:
            before = rally.strokes
            for received in self._messages.take():
                follower.take(received.robot, received.message)
            for watch in self._watches.values():
                watch.read()
            if rally.strokes > before:
                counted(rally.strokes)
        rally.over = follower.end_reason()
        rally.checked = {name: watch.check(follower.touches[name]) for name, watch in self._watches.items()}
        return rally

    def _wait_for_rest(self) -> None:
        """Wait until both arms have rested for `REST_S` of robot time, at most `READY_S`."""
        since: dict[str, float] = {}
        deadline = time.monotonic() + READY_S
        while time.monotonic() < deadline:
            rested = [self._rests(name, bus, since) for name, bus in self._buses.items()]
            if all(rested):
                return
            time.sleep(0.05)

    @staticmethod
    def _rests(name: str, bus: Bus, since: dict[str, float]) -> bool:
        """Return whether an arm has rested long enough, and reset a fault; `since`: start of each arm's rest, s."""
        with contextlib.suppress(Refusal, NoAnswer):
            status = bus.ask(topics.STATUS_QUERY, m.Empty())
            if status.mode == "fault":
                bus.ask(topics.RESET, m.Empty())
            if status.mode == "holding":
                return status.time - since.setdefault(name, status.time) > REST_S
            since.pop(name, None)
        return False
