"""Play rallies of two arms on running services: serve, follow the ball, report the rally."""

import contextlib
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig
from tools.rally.exchange import away, exchange, serve
from tools.rally.limit_watch import Findings, LimitWatch
from tools.rally.referee import Referee
from tools.rally.touches import touched

OWN = (topics.CONTACT, topics.ENDED, topics.STRIKES)
"""Topics that are followed for each arm, in its own time; the referee uses the first arm's ball and contacts."""
READY_S = 30.0
"""Longest wait for both arms to rest before the next serve, s of wall time."""
REST_S = 0.2
"""Rest before a serve, s of robot time."""
STALLED_S = 10.0
"""Timeout of the sim's ball messages, s of wall time."""


@dataclass(slots=True, eq=False)
class Rally:
    """One rally.

    Attributes:
        server: The arm from whose half the ball was served.
        strokes: Number of strokes that counted.
        over: Reason of the rally's end.
        duration: Robot time, s.
        faults: A sentence for each motion that was aborted, and each contact without the ball.
        checked: Use of the limits by commands and states, by arm.
    """

    server: str
    strokes: int = 0
    over: str = ""
    duration: float = 0.0
    faults: list[str] = field(default_factory=list)
    checked: dict[str, Findings] = field(default_factory=dict)

    def violations(self) -> list[str]:
        """Return a sentence for each fault, and for each arm that exceeded a limit."""
        passed = [(name, found) for name, found in self.checked.items() if found.violations]
        return self.faults + [
            f"{name}: {found.violations} ticks beyond a limit: {found.worst}" for name, found in passed
        ]


class _Course:
    """Follows a rally message by message."""

    def __init__(self, rally: Rally, arms: Mapping[str, RobotConfig], served: float) -> None:
        """`served`: when (s) the ball was thrown, in the time of the first arm."""
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
                self.referee.see(message)
                self._rally.duration = max(self._rally.duration, message.time - self._served)
            case m.Contact():
                self._touch(name, message)
            case m.Strike():
                self._reasons[name] = message.reason if message.phase in ("refused", "missed") else ""
            case m.Result() if message.outcome == "aborted":
                self._rally.faults.append(f"{name}: goal {message.goal_id} was aborted: {message.reason}")
        self._rally.strokes = self.referee.strokes

    def ended_by(self) -> str:
        """Return why the rally has ended, with the strikers' last sentences."""
        if not self.referee.over:
            return "as many as were asked for"
        said = "; ".join(f"{name}: {reason}" for name, reason in self._reasons.items() if reason)
        return f"{self.referee.over}{f' ({said})' if said else ''}"

    def _touch(self, name: str, contact: m.Contact) -> None:
        if self._arms[name].bodies.intersection(contact.bodies):
            self.touches[name].append(contact.time)
        if name != self._first:
            return
        self.referee.touch(contact)
        if sentence := touched(contact):
            self._rally.faults.append(sentence)


class Court:
    """Plays rallies on the services of two running cells."""

    def __init__(self, buses: Mapping[str, Bus], configs: Mapping[str, RobotConfig], seed: int, most: int) -> None:
        """`buses`, `configs`: bus and description of each arm, by name; `most`: strokes after which a rally ends."""
        self._buses, self._configs, self._most = buses, configs, most
        self._random = np.random.default_rng(seed)
        self._received: SimpleQueue[tuple[str, m.BallState | m.Contact | m.Result | m.Strike]] = SimpleQueue()
        self._first = next(iter(buses))
        self._listen(self._first, topics.BALL)
        for name in buses:
            for topic in OWN:
                self._listen(name, topic)
        self._watches = {name: LimitWatch(bus, configs[name]) for name, bus in buses.items()}
        one, other = configs
        self._exchanges = {a: exchange(configs[a], configs[b]) for a, b in ((one, other), (other, one))}

    def begin(self, noise: m.Disturb | None, revise_hz: float) -> None:
        """Add noise to the cameras, and make both strikers return balls."""
        for name, bus in self._buses.items():
            if noise is not None:
                bus.ask(topics.SIM_DISTURB, noise)
            play = self._exchanges[name]
            x, y, z = play.target.tolist()
            order = m.StrikeRequest(target=(x, y, z), flight_time=play.flight_time, revise_hz=revise_hz)
            bus.ask(topics.STRIKE, order)

    def play(self, server: str) -> Iterator[Rally]:
        """Serve from the half of `server`, and yield the rally after every stroke and at its end.

        Raises:
            Refusal: the ball cannot be served.
            NoAnswer: the sim does not reply.
        """
        self._buses[self._first].ask(topics.SIM_BALL, away(self._configs[self._first]))
        self._wait_for_rest()
        throw = serve(self._configs[server], self._exchanges[server], self._random)
        self._drain()
        served = self._buses[self._first].ask(topics.SIM_BALL, throw).time
        rally = Rally(server)
        course = _Course(rally, self._configs, served)
        while not course.referee.over and rally.strokes < self._most:
            counted = rally.strokes
            course.take(*self._take())
            for watch in self._watches.values():
                watch.read()
            if rally.strokes > counted:
                yield rally
        rally.over = course.ended_by()
        rally.checked = {name: watch.check(course.touches[name]) for name, watch in self._watches.items()}
        yield rally

    def _listen(self, name: str, topic: topics.Publication[Any]) -> None:
        self._buses[name].listen(topic, lambda body: self._received.put((name, decode(body, topic.message))))

    def _take(self) -> tuple[str, Any]:
        """Return the next message and its arm. Raises NoAnswer if none arrives."""
        try:
            return self._received.get(timeout=STALLED_S)
        except Empty:
            key = self._buses[self._first].key(topics.BALL.key)
            raise NoAnswer("sim", key, f"no ball was seen for {STALLED_S:g} s") from None

    def _drain(self) -> None:
        for watch in self._watches.values():
            watch.drop()
        with contextlib.suppress(Empty):
            while True:
                self._received.get_nowait()

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
