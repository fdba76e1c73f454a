"""`python -m benchmarks.striking`: balls thrown at the shipped arm and returned, without bus and wall clock.

It uses the striker's mathematics (`services.striker.hit_planner`). Motions are planned by `motion.plan`, checked for
collisions and torques as in the planner, and played by the simulated arm with the controller's tracking law. A motion
begins a fixed time after its sight, so only the processor times depend on the machine.
"""

import gc
import json
import logging
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import tyro

from benchmarks.table_tennis.motions import Motion, make_motion, violations
from benchmarks.timing import milliseconds
from deploy.demonstrations.make_forehand import forehand
from motion.demonstration import Demonstration
from motion.errors import MotionError
from motion.primitive import learn
from motion.tracking import tracking_acceleration
from protocol.messages import BallState, Contact, Disturb, Throw
from robot.court import BALL
from robot.description import load_robot
from robot.motion_check import MotionCheck
from robot.striking.choice import Choice, NoHit, State
from robot.striking.launcher import HEIGHTS, Launcher
from robot.striking.scoring import Score, score
from services.common.robot_side.backend import Setpoint
from services.sim.arm import SimulatedArm
from services.striker.attempt import Attempt
from services.striker.hit_planner import MIN_SIGHTS, HitPlanner
from services.striker.orders import Order
from services.striker.swing import CHOICE_PERIOD_S

AFTER_HIT_S, AFTER_ARRIVAL_S = 0.4, 2.0
"""A ball is followed for these times after its landing and its expected arrival, s."""
LEGS = "sight", "choice", "correction", "plan", "simulated contact"
AnswerT = TypeVar("AnswerT")


@dataclass(frozen=True)
class Flags:
    """Throw balls at the shipped arm; print the results and processor times.

    balls: number of balls. noise: of each coordinate of a sight, m. latency: of a sight, s. drag_error,
    restitution_error: relative errors of the assumed values. wind: across the court, m/s, unknown to the striker.
    first_lead, lead: from a sight's arrival to the begin of its motion, s. period: between corrections, s. until: least
    time from the begin of a correction to the touch, s. heights: of arriving balls, m.
    """

    balls: int = 20
    seed: int = 0
    noise: float = 0.005
    latency: float = 0.01
    drag_error: float = 0.1
    restitution_error: float = 0.05
    wind: float = 0.0
    target: tuple[float, float, float] = (4.5, 0.0, 0.0)
    first_lead: float = 0.05
    lead: float = 0.015
    period: float = 0.02
    until: float = 0.05
    heights: tuple[float, float] = HEIGHTS
    json: bool = False
    verbose: bool = False


@dataclass(slots=True, eq=False)
class Stroke:
    """A ball on its way: the hit that is played, its motions, its sights."""

    attempt: Attempt = field(default_factory=lambda: Attempt(1))
    motions: list[Motion] = field(default_factory=list)
    sights: list[BallState] = field(default_factory=list)
    contacts: list[Contact] = field(default_factory=list)
    refused: int = 0


class Rally:
    """The arm and its striker. seconds: processor times (s) by leg."""

    def __init__(self, flags: Flags, folder: Path) -> None:
        self._flags = flags
        self._config = config = load_robot()
        assert config.ball is not None
        assert config.court is not None
        self._court = config.court
        believed = replace(
            config,
            ball=replace(config.ball, drag=config.ball.drag * (1 + flags.drag_error)),
            court=replace(config.court, restitution=config.court.restitution * (1 + flags.restitution_error)),
        )
        self._arm = SimulatedArm(config)
        self._launcher = Launcher(config, flags.seed, heights=flags.heights)
        self._hit_planner = HitPlanner(believed, folder / "learned.json", logging.getLogger("striker"))
        self._order = Order(np.array(flags.target), None, (), flags.period, flags.until)
        self._check = MotionCheck(config)
        self._primitive = learn(Demonstration(*forehand(config.home.tolist())))
        self._rest = State(0.0, config.home, np.zeros(config.joint_count), np.zeros(config.joint_count))
        self.seconds: dict[str, list[float]] = {leg: [] for leg in LEGS}

    def play(self, number: int) -> tuple[Stroke, Score]:
        """Throw a ball and play until it has landed; return the stroke and its score."""
        flags, arm, stroke, launch = self._flags, self._arm, Stroke(), self._launcher.next()
        arm.reset(seed=flags.seed * 100_000 + number)
        if flags.noise or flags.latency:
            arm.disturb(Disturb(kind="ball_noise", position_std=flags.noise, latency_s=flags.latency))
        if flags.wind:
            arm.disturb(Disturb(kind="wind", values=[0.0, flags.wind, 0.0]))
        arm.throw(Throw(position=launch.position, velocity=launch.velocity))
        self._hit_planner.estimator.reset()
        until = launch.flight_time + AFTER_ARRIVAL_S
        while (now := arm.observe().time) < until:
            self._track(stroke, now)
            for contact in arm.contacts():
                stroke.contacts.append(contact)
                self._hit_planner.note_contact(stroke.attempt, contact)
            for sight in arm.sights():
                stroke.sights.append(sight)
                self._see(stroke, sight)
            found = self._score(stroke) if stroke.contacts and round(1e3 * now) % 50 == 0 else Score()
            if (found.landed_time is not None or found.net) and now > (found.hit_time or 0.0) + AFTER_HIT_S:
                break
        if stroke.attempt.choice is not None:
            self._hit_planner.evaluate(stroke.attempt)
        return stroke, self._score(stroke)

    def violations(self, stroke: Stroke) -> int:
        """Return the number of instants at which the played motion exceeds a limit, without the planner's code."""
        motions = stroke.motions
        return violations(self._config.limits, motions, motions[-1].hit + 0.2) if motions else 0

    def touched(self, stroke: Stroke) -> bool:
        """Return whether the arm touched anything except the ball: itself, the floor, the net."""
        return any(BALL not in contact.bodies for contact in stroke.contacts)

    def _score(self, stroke: Stroke) -> Score:
        return score(stroke.contacts, stroke.sights, self._court, self._config.bodies, self._flags.target)

    def _track(self, stroke: Stroke, now: float) -> None:
        """Step the arm along its reference."""
        here, tick = self._arm.observe(), self._config.tick
        begin, end = (self._reference(stroke, time) for time in (now, now + tick))
        feedforward = (end.velocities - begin.velocities) / tick
        state = np.array(here.positions), np.array(here.velocities)
        reference = begin.positions, begin.velocities, feedforward
        accelerations = tracking_acceleration(self._config.alpha, reference, *state)
        self._arm.step(Setpoint(accelerations, end.positions, end.velocities, feedforward))

    def _reference(self, stroke: Stroke, time: float) -> State:
        current = self._current(stroke, time)
        return replace(self._rest, time=time) if current is None else current.state(time)

    def _current(self, stroke: Stroke, time: float) -> Motion | None:
        return next((motion for motion in reversed(stroke.motions) if motion.start <= time + 1e-9), None)

    def _see(self, stroke: Stroke, sight: BallState) -> None:
        """Process a sight; choose or correct a hit if that is due."""
        planner, flags, attempt = self._hit_planner, self._flags, stroke.attempt
        now, place = self._arm.observe().time, np.array(sight.position)
        if attempt.choice is not None and sight.time > attempt.choice.time:
            if not attempt.has_flown(sight.time):
                attempt.sights.append((sight.time, place))
            return
        velocity = None if sight.velocity is None else np.array(sight.velocity)
        self._timed("sight", lambda: planner.estimator.observe(sight.time, place, velocity))
        estimate = planner.estimator.estimate
        if estimate is None or estimate.sights < MIN_SIGHTS or not planner.is_approaching(estimate):
            return
        if estimate.time < stroke.attempt.sight_time + flags.period - 1e-6:
            return
        if attempt.choice is None:
            self._first(stroke, now)
        elif now < attempt.choice.time - flags.until:
            self._correct(stroke, attempt.choice, now)
        stroke.attempt.sight_time = estimate.time if stroke.motions else -np.inf

    def _first(self, stroke: Stroke, now: float) -> None:
        if now < stroke.attempt.next_search:
            return
        start = replace(self._rest, time=now + self._flags.first_lead)
        stroke.attempt.next_search = now + CHOICE_PERIOD_S
        gc.collect(1)
        try:
            choices = self._timed("choice", lambda: self._hit_planner.choose(start, self._order))
        except NoHit as reason:
            stroke.attempt.reason = str(reason)
            return
        for choice in choices:
            if self._plan(stroke, choice, start, 0.0):
                break

    def _correct(self, stroke: Stroke, last: Choice, now: float) -> None:
        start = self._reference(stroke, now + self._flags.lead)
        current = self._current(stroke, start.time)
        if current is None:
            return
        try:
            choices = self._hit_planner.correct(start, self._order, last)
            while (better := self._timed("correction", lambda: next(choices, None))) is not None:
                if self._plan(stroke, better, start, current.phase_at(start.time)):
                    stroke.attempt.revisions += 1
                    stroke.attempt.choice = self._timed(
                        "simulated contact", lambda: self._hit_planner.with_simulated_contact(better)
                    )
                    break
        except NoHit as reason:
            stroke.attempt.reason = str(reason)

    def _plan(self, stroke: Stroke, choice: Choice, start: State, phase: float) -> bool:
        """Play a hit from now on, if a feasible motion without collisions exists."""
        motion = self._timed("plan", lambda: self._motion(choice, start, phase))
        if motion is None:
            stroke.refused += 1
            return False
        stroke.motions.append(motion)
        stroke.attempt.choice = choice
        return True

    def _motion(self, choice: Choice, start: State, phase: float) -> Motion | None:
        follow_through = self._hit_planner.follow_through
        motion = make_motion("qp", self._primitive, self._config.limits, start, choice, phase, follow_through)
        try:
            if motion is not None:
                self._check.check(motion.trajectory, motion.trajectory.duration)
        except MotionError:
            return None
        return motion

    def _timed(self, leg: str, work: Callable[[], AnswerT]) -> AnswerT:
        """Do some work and record its processor time, even if it fails."""
        began = time.thread_time()
        try:
            return work()
        finally:
            self.seconds[leg].append(time.thread_time() - began)


def summary(rally: Rally, played: list[tuple[Stroke, Score]]) -> dict[str, object]:
    """Return the statistics of a rally."""
    scores = [found for _, found in played]
    away = np.array([np.inf if found.distance is None else found.distance for found in scores])
    found: dict[str, object] = {
        "balls": len(scores),
        "hit": sum(found.hit for found in scores),
        "returned": sum(found.returned for found in scores),
        "within_30cm": int((away < 0.3).sum()),
        "within_20cm": int((away < 0.2).sum()),
        "median_error_m": round(float(np.median(away)), 3),
        "corrections": round(sum(stroke.attempt.revisions for stroke, _ in played) / len(played), 1),
        "refused": round(sum(stroke.refused for stroke, _ in played) / len(played), 1),
        "violations": sum(rally.violations(stroke) for stroke, _ in played),
        "touched_other_than_ball": sum(rally.touched(stroke) for stroke, _ in played),
    }
    for leg, values in rally.seconds.items():
        found[leg] = {name: round(ms, 2) for name, ms in milliseconds(values).items()}
    return found


def main() -> int:
    """Play, and print the statistics."""
    flags = tyro.cli(Flags)
    with tempfile.TemporaryDirectory(prefix="volley-striking-") as folder:
        rally = Rally(flags, Path(folder))
        gc.freeze()
        played = []
        for number in range(flags.balls):
            stroke, found = rally.play(number)
            played.append((stroke, found))
            if flags.verbose:
                away = "-" if found.distance is None else f"{found.distance:.2f} m"
                print(f"{number}: hit {found.hit}, {away}, {stroke.attempt.reason}", file=sys.stderr, flush=True)
        figures = summary(rally, played)
    print(json.dumps(figures) if flags.json else "\n".join(f"{name}: {value}" for name, value in figures.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
