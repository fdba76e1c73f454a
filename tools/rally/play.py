"""Throw balls at an arm with running services, and collect the outcome of each."""

import contextlib
import math
import time
from dataclasses import dataclass, field

import numpy as np

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.errors import NoAnswer, Refusal
from robot.court import BALL, CourtConfig
from robot.description import RobotConfig
from robot.striking.launcher import Launch, Launcher
from robot.striking.scoring import Score, score
from tools.rally.latency import Latency, latencies
from tools.rally.limit_monitor import LimitMonitor, LimitReport
from tools.rally.received import Messages, forbidden_contact

AFTER_ARRIVAL_S = 2.0
"""Longest wait after a ball's arrival until it has landed, s of robot time."""
AFTER_LANDING_S = 0.15
"""Time after the landing in which further messages are collected, s of robot time."""
REST_S = 4.0
"""Longest wait for the arm to rest before the next ball, s of wall time."""
JUMPS_AT = 0.5
"""Fraction of a ball's flight after which a moving target jumps."""
TOPICS = (topics.BALL, topics.CONTACT, topics.STRIKES, topics.ENDED)


Place = tuple[float, float, float]


class Targets:
    """Positions of a target that jumps within `wander`, m, of `middle` along x and y, or stays there if that is 0."""

    def __init__(self, middle: Place, wander: float, seed: int) -> None:
        self._middle = middle
        self._wander = wander
        self._random = np.random.default_rng([seed, 1])

    @property
    def move(self) -> bool:
        """Whether the target moves."""
        return self._wander > 0

    def next(self) -> Place:
        """Return the next position, m."""
        x, y, z = self._middle
        if not self.move:
            return self._middle
        offset = self._wander * self._random.uniform(-1, 1, 2)
        return x + float(offset[0]), y + float(offset[1]), z


@dataclass(slots=True, eq=False)
class Stroke:
    """One ball: its launch, the striker's messages about it, the results of its motions, its score.

    `forbidden_contacts` has a sentence for each contact without the ball.
    """

    launch: Launch
    strikes: list[m.Strike] = field(default_factory=list)
    results: list[m.Result] = field(default_factory=list)
    latencies: list[Latency] = field(default_factory=list)
    score: Score = field(default_factory=Score)
    limits: LimitReport = field(default_factory=LimitReport)
    forbidden_contacts: list[str] = field(default_factory=list)

    @property
    def corrections(self) -> int:
        """Number of accepted corrections."""
        return sum(strike.phase == "revised" for strike in self.strikes)

    def reason(self) -> str:
        """Return the striker's last reason for not playing the ball, or an empty string."""
        return next((s.reason for s in reversed(self.strikes) if s.phase in ("refused", "missed") and s.reason), "")

    def aborted(self) -> list[m.Result]:
        """Return the results of the motions that were aborted."""
        return [result for result in self.results if result.outcome == "aborted"]

    def faults(self) -> list[str]:
        """Return a sentence for each aborted motion and each forbidden contact, and one if limits were exceeded."""
        found = [f"goal {r.goal_id} was aborted: {r.reason}" for r in self.aborted()] + self.forbidden_contacts
        if self.limits.violations:
            worst = self.limits.worst
            found.append(f"limits were exceeded at {self.limits.violations} ticks; at {worst.time:.3f} s {worst}")
        return found


class Player:
    """Throws the balls of a launcher at an arm."""

    def __init__(self, bus: Bus, config: RobotConfig, launcher: Launcher, targets: Targets, revise_hz: float) -> None:
        """`targets`: targets of the returned balls; `revise_hz`: rate of corrections, Hz."""
        assert config.court is not None
        self._bus = bus
        self._court: CourtConfig = config.court
        self._bodies = config.bodies
        self._launcher = launcher
        self._targets = targets
        self._target = (0.0, 0.0, 0.0)
        self._revise_hz = revise_hz
        self._watch = LimitMonitor(bus, config)
        self._messages = Messages((bus, topic) for topic in TOPICS)
        self._aim()

    def play(self) -> Stroke:
        """Wait until the arm rests, throw a ball, and follow it until it has landed.

        Raises:
            Refusal: the ball cannot be thrown.
            NoAnswer: the sim does not reply, or publishes no ball.
        """
        self._wait_for_rest()
        self._watch.drop()
        stroke = Stroke(self._launcher.next())
        if self._targets.move:
            self._aim()
        contacts: list[m.Contact] = []
        sights: list[m.BallState] = []
        routed_ns: dict[float, int] = {}
        self._messages.waiting()  # discard the messages about the ball before
        launch = stroke.launch
        thrown = self._bus.ask(topics.SIM_BALL, m.Throw(position=launch.position, velocity=launch.velocity)).time
        until, now = thrown + launch.flight_time + AFTER_ARRIVAL_S, thrown
        jumps_at = thrown + launch.flight_time * JUMPS_AT if self._targets.move else math.inf
        while now < until:
            for _, message, message_routed_ns in self._messages.take():
                match message:
                    case m.BallState():
                        now = max(now, message.time)
                        sights.append(message)
                        routed_ns[message.time] = message_routed_ns
                    case m.Contact():
                        contacts.append(message)
                    case m.Strike():
                        stroke.strikes.append(message)
                    case _:
                        stroke.results.append(message)
            self._watch.read()
            if now > jumps_at:
                self._aim()
                jumps_at = math.inf
            stroke.score = score(contacts, sights, self._court, self._bodies, self._target)
            if stroke.score.landed_time is not None or stroke.score.net:
                until = min(until, now + AFTER_LANDING_S)
        stroke.forbidden_contacts = [sentence for contact in contacts if (sentence := forbidden_contact(contact))]
        stroke.latencies = latencies(stroke.strikes, stroke.results, routed_ns)
        stroke.limits = self._watch.check(
            [c.time for c in contacts if BALL in c.bodies and self._bodies & set(c.bodies)]
        )
        return stroke

    def _aim(self) -> None:
        """Request strikes to the next target."""
        self._target = self._targets.next()
        self._bus.ask(topics.STRIKE, m.StrikeRequest(target=self._target, revise_hz=self._revise_hz))

    def _wait_for_rest(self) -> None:
        """Wait until the arm has rested for four polls, at most `REST_S`."""
        deadline, rests = time.monotonic() + REST_S, 0
        while rests < 4 and time.monotonic() < deadline:
            time.sleep(0.05)
            self._watch.read()
            with contextlib.suppress(Refusal, NoAnswer):
                rests = rests + 1 if self._bus.ask(topics.STATUS_QUERY, m.Empty()).mode == "holding" else 0
