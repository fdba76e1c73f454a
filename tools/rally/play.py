"""Throws balls at a running cell and collects what becomes of each."""

import contextlib
import math
import time
from dataclasses import dataclass, field
from typing import Any

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from robot.court import BALL, CourtConfig
from robot.description import RobotConfig
from robot.striking.launcher import Launch, Launcher
from robot.striking.scoring import Score, score
from tools.rally.latency import Latency, latencies
from tools.rally.limit_watch import Findings, LimitWatch
from tools.rally.targets import Targets
from tools.rally.touches import touched

AFTER_ARRIVAL_S = 2.0
"""A ball that has not landed so long (robot time) after its arrival is not waited for."""
AFTER_LANDING_S = 0.15
REST_S = 4.0
"""How long (wall time) the arm may take to be ready for the next ball."""
JUMPS_AT = 0.5
"""Part of a ball's flight after which a target that moves jumps."""
STALLED_S = 5.0
"""A sim that shows no ball for so long (wall time) is gone."""
TOPICS = (topics.BALL, topics.CONTACT, topics.STRIKES, topics.ENDED)
LENGTH = 1024
"""Messages of a topic that may wait."""
POLL_S = 0.01
"""Between looks for messages: a wait for each would take time from striker and planner just when a sight comes."""


@dataclass(slots=True, eq=False)
class Stroke:
    """One ball: how it was thrown, what the striker said of it, how its motions ended, its score.

    touched: a sentence for each contact without the ball.
    """

    launch: Launch
    said: list[m.Strike] = field(default_factory=list)
    results: list[m.Result] = field(default_factory=list)
    latencies: list[Latency] = field(default_factory=list)
    score: Score = field(default_factory=Score)
    limits: Findings = field(default_factory=Findings)
    touched: list[str] = field(default_factory=list)

    @property
    def corrections(self) -> int:
        """Corrections that were taken."""
        return sum(strike.phase == "revised" for strike in self.said)

    def reason(self) -> str:
        """Return the striker's last sentence about why it did not play, or empty."""
        return next((s.reason for s in reversed(self.said) if s.phase in ("refused", "missed") and s.reason), "")

    def aborted(self) -> list[m.Result]:
        """Return the motions that were not played to their end."""
        return [result for result in self.results if result.outcome == "aborted"]

    def faults(self) -> list[str]:
        """Return a sentence for each aborted motion and each contact without the ball, and one for passed limits."""
        found = [f"goal {r.goal_id} was aborted: {r.reason}" for r in self.aborted()] + self.touched
        if self.limits.violations:
            worst = self.limits.worst
            found.append(f"limits were passed at {self.limits.violations} ticks; at {worst.time:.3f} s {worst}")
        return found


class Player:
    """Throws balls of `launcher` on the services that `bus` reaches."""

    def __init__(self, bus: Bus, config: RobotConfig, launcher: Launcher, targets: Targets, revise_hz: float) -> None:
        """`targets`: where the striker is asked to return them, corrected `revise_hz` times a second."""
        assert config.court is not None
        self._bus = bus
        self._court: CourtConfig = config.court
        self._bodies = config.bodies
        self._launcher = launcher
        self._targets = targets
        self._target = (0.0, 0.0, 0.0)
        self._revise_hz = revise_hz
        self._watch = LimitWatch(bus, config)
        self._sources = [(topic, bus.collect(topic, LENGTH)) for topic in TOPICS]
        self._aim()

    def play(self) -> Stroke:
        """Wait until the arm rests, throw a ball, and follow it until it has landed.

        Raises:
            Refusal: the ball cannot be thrown.
            NoAnswer: the sim is silent.
        """
        self._wait_for_rest()
        self._watch.drop()
        stroke = Stroke(self._launcher.next())
        if self._targets.move:
            self._aim()
        contacts: list[m.Contact] = []
        sights: list[m.BallState] = []
        seen: dict[float, int] = {}
        self._waiting()  # of the ball before
        launch = stroke.launch
        thrown = self._bus.ask(
            topics.SIM_BALL, m.Throw(position=launch.position, velocity=launch.velocity, spin=launch.spin)
        ).time
        until, now = thrown + launch.flight_time + AFTER_ARRIVAL_S, thrown
        jumps_at = thrown + launch.flight_time * JUMPS_AT if self._targets.move else math.inf
        while now < until:
            for message, routed_ns in self._take():
                match message:
                    case m.BallState():
                        now = max(now, message.time)
                        sights.append(message)
                        seen[message.time] = routed_ns
                    case m.Contact():
                        contacts.append(message)
                    case m.Strike():
                        stroke.said.append(message)
                    case _:
                        stroke.results.append(message)
            self._watch.read()
            if now > jumps_at:
                self._aim()
                jumps_at = math.inf
            stroke.score = score(contacts, sights, self._court, self._bodies, self._target)
            if stroke.score.landed_time is not None or stroke.score.net:
                until = min(until, now + AFTER_LANDING_S)
        stroke.touched = [sentence for contact in contacts if (sentence := touched(contact))]
        stroke.latencies = latencies(stroke.said, stroke.results, seen)
        stroke.limits = self._watch.check(
            [c.time for c in contacts if BALL in c.bodies and self._bodies & set(c.bodies)]
        )
        return stroke

    def _aim(self) -> None:
        """Ask the striker to strike balls to the next target."""
        self._target = self._targets.next()
        self._bus.ask(topics.STRIKE, m.StrikeRequest(target=self._target, revise_hz=self._revise_hz))

    def _take(self) -> list[tuple[Any, int]]:
        """Return the next messages and when the router had them, Unix ns. Raises NoAnswer where none come."""
        deadline = time.monotonic() + STALLED_S
        while time.monotonic() < deadline:
            if found := self._waiting():
                return found
            time.sleep(POLL_S)
        raise NoAnswer("sim", self._bus.key(topics.BALL.key), f"no ball was seen for {STALLED_S:g} s")

    def _waiting(self) -> list[tuple[Any, int]]:
        found: list[tuple[Any, int]] = []
        for topic, source in self._sources:
            while (taken := source.take()) is not None:
                found.append((decode(taken[0], topic.message), taken[1]))
        return found

    def _wait_for_rest(self) -> None:
        """Return once the arm has rested for a moment, at the latest after `REST_S`."""
        deadline, calm = time.monotonic() + REST_S, 0
        while calm < 4 and time.monotonic() < deadline:
            time.sleep(0.05)
            self._watch.read()
            with contextlib.suppress(Refusal, NoAnswer):
                calm = calm + 1 if self._bus.ask(topics.STATUS_QUERY, m.Empty()).mode == "holding" else 0
