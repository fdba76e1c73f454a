"""Play balls of the environment: follow the ball, choose, plan, track, correct, learn."""

import itertools
import time as clock
from collections.abc import Iterator
from pathlib import Path as Folder
from typing import Any

import numpy as np

from benchmarks.table_tennis.balls import Ball
from benchmarks.table_tennis.checks import ArmCheck, distance, violations
from benchmarks.table_tennis.demonstrations import learned, quintic
from benchmarks.table_tennis.motions import make_motion
from benchmarks.table_tennis.motors import Motors
from benchmarks.table_tennis.played import Motion
from benchmarks.table_tennis.scene import BALL, CONTROL_S, FIRST_S, OFFSET, RACKET, court, environment, robot, was_hit
from benchmarks.table_tennis.variants import SERIES, Variant
from robot.motion_check import Collides, MotionCheck
from robot.striking.arm import Arm
from robot.striking.calibration import calibrate
from robot.striking.choice import Choice, NoHit, State, distinct_first
from robot.striking.chooser import Chooser
from robot.striking.contact import ContactLaw
from robot.striking.corrections import HORIZON_S, Corrections
from robot.striking.estimator import Estimator, NoiseModel
from robot.striking.flight import Air
from robot.striking.learning import Learner, outgoing_velocity
from robot.striking.options import Options
from robot.striking.reachability import Reachability
from robot.striking.recoil import Recoil
from robot.striking.simulated_contact import SimulatedContact
from robot.torque_check import TorqueExceeded

LATENCY_S = 0.008
"""Time from a sight to the begin of its motion, s."""
CANDIDATES = 40
"""Number of hits to plan, one after the other, until one is feasible without collisions."""
TRIES = 12
"""The same for a correction, for hits near the last one and for hits elsewhere."""
HOPELESS_M = 0.18
"""Expected landing error of a correction, m, above which hits elsewhere are searched first."""
EXACT_M = 1e-4
"""Assumed standard deviation (m) of a sight without noise. With a hundredth of it sights after the bounce would be
rejected, and start a new ball, for which another bounce is allowed."""
UNTIL_S = 0.05
"""Least time from the begin of a correction to the touch, s."""
OMEGA, DAMPING = 40.0, 1.4
"""Gains of the tracking: ω², and 1.4 ω."""


class Player:
    """Plays balls of one variant. The result of a ball depends on its seed only, not on earlier balls.

    In a variant that learns the racket, it depends on the earlier balls of its series, which are played first if
    necessary.
    """

    def __init__(self, variant: Variant, folder: Folder, demonstration: Folder | None = None) -> None:
        """Prepare. folder: for the robot's description and its table of postures. demonstration: a CSV file.

        Raises:
            NotInstalled: fancy_gym or gymnasium is missing.
            ValueError: the demonstration cannot be used.
        """
        self.variant = variant
        self._env: Any = environment(variant.environment)
        self._config = config = robot(folder, variant.scale)
        self._limits = config.limits
        self._arm = Arm(config, RACKET, BALL)
        self._table = Reachability.of(config, folder)
        self._contact = SimulatedContact(config, "target_ball")
        self._contact.law = law = calibrate(self._arm, self._table, self._contact).law
        if not variant.noise and not variant.racket:
            self._contact.phases = ()  # the time of the touch is known
        self._law = law
        self.learner, self._played = Learner.of(law), -1
        simulate = self._contact if variant.simulated else None
        options, room = Options(**variant.options), Recoil(self._arm).has_room
        self._chooser = Chooser(self._arm, self._table, court(), law, options, simulate, room)
        self._check = MotionCheck(config)
        self._motors = Motors(self._env, config.joint_names)
        self._arm_check = ArmCheck(self._env, config.limits)
        self.primitive = learned(demonstration) if demonstration else quintic(self._arm, self._table, law, config.home)

    def play(self, seed: int) -> Ball:
        """Play the ball of a seed."""
        first = seed - seed % SERIES
        learns = self.variant.learns
        if not (learns and first <= self._played < seed):
            self._believe(first)
        for earlier in range(self._played + 1, seed) if learns else ():
            self._play(earlier)
        return self._play(seed)

    def _believe(self, first: int) -> None:
        """Begin the series of a seed, with a wrong assumed restitution of the racket."""
        wrong = _sign(np.random.default_rng((first, 1))) * self.variant.racket
        law = self._law
        self.learner = Learner.of(ContactLaw(law.restitution * (1 + wrong), law.friction, law.duration))
        self._played = first - 1

    def _play(self, seed: int) -> Ball:
        self._played = seed
        rng = np.random.default_rng(seed)
        variant, env = self.variant, self._env
        believed = court(1 + _sign(rng) * variant.table)
        wind = (1.0, 1.0, 0.0) if variant.wind else (0.0, 0.0, 0.0)
        noise = NoiseModel(
            max(variant.noise, EXACT_M),
            velocity_std=1e-6,
            restitution_std=0.08 if variant.table else 1e-4,
            wind_std=wind,
            unmodelled=0.02 if variant.noise else 1e-4,
        )
        estimator = Estimator(BALL, believed, noise)
        estimator.reset()
        self._chooser.law = self.learner.law
        result, motions = Ball(), list[Motion]()
        choice: Choice | None = None
        planned_at = -np.inf
        after: list[tuple[float, np.ndarray]] = []
        observation, _ = env.reset(seed=seed)
        self._arm_check.begin()
        now, done, info = 0.0, False, {}
        target = np.zeros(3)
        while not done:
            target = np.append(observation[-2:], believed.surface.height)
            place = observation[14:17] + np.array([0.0, 0.0, OFFSET])
            seen = place + variant.noise * rng.normal(size=3)
            # Used only to select the sights of the outgoing ball.
            if was_hit(env.unwrapped):
                after.append((now, seen))
            else:
                velocity = observation[17:20] if variant.wind else None
                estimator.observe(now, seen, velocity)
                wanted = now >= FIRST_S - 1e-9 if choice is None else variant.corrected
                due = now - planned_at >= variant.period - 1e-9
                late = choice is not None and now + LATENCY_S > choice.time - UNTIL_S
                if wanted and due and not late:
                    began = clock.thread_time()
                    decided = self._decide(estimator, motions, now, target, choice, result)
                    if choice is not None:
                        result.planned_ms.append(_ms_since(began))
                    if decided is not None:
                        choice, planned_at = decided, now
            observation, _, done, _, info = env.step(self._action(observation, motions, now))
            now += CONTROL_S
        self._judge(result, info, motions, now)
        if choice is not None and variant.learns and result.hit:
            self._learn(choice, after)
        return result

    def _decide(
        self,
        estimator: Estimator,
        motions: list[Motion],
        now: float,
        target: np.ndarray,
        last: Choice | None,
        result: Ball,
    ) -> Choice | None:
        """Choose or correct, and plan; return the hit that is played from now on, None if nothing changes."""
        begin = now + LATENCY_S
        began = clock.thread_time()
        if last is None:
            home, phase = self._config.home, 0.0
            start = State(begin, home, np.zeros_like(home), np.zeros_like(home))
            choices = self._first(estimator, start, target)
        else:
            start, phase = motions[-1].state(begin), motions[-1].phase_at(begin)
            corrections = Corrections(self._chooser, estimator, TRIES, HOPELESS_M, self.variant.earliest)
            choices = corrections.of(last, start, target)
        try:
            best = next(choices)
            spent = _ms_since(began)
            if last is None:
                result.first_ms = spent
            else:
                result.correction_ms.append(spent)
            for rank, choice in enumerate(itertools.chain([best], choices)):
                motion = self._motion(start, choice, phase)
                if motion is not None and last is None and rank:
                    finer = self._chooser.refined(choice, start)
                    again = self._motion(start, finer, phase)
                    choice, motion = (choice, motion) if again is None else (finer, again)
                if motion is not None:
                    motions.append(motion)
                    result.planned = True
                    result.corrections += last is not None
                    return choice if last is None else self._chooser.with_simulated_contact(choice)
            result.note = "plan"
        except NoHit as error:
            result.note = error.reason
        result.refused += 1
        return None

    def _motion(self, start: State, choice: Choice, phase: float) -> Motion | None:
        """Return the motion to a hit, None if it is refused for limits, collisions or torques."""
        motion = make_motion(self.variant.method, self.primitive, self._limits, start, choice, phase)
        try:
            if motion is not None:
                self._check.check(motion.trajectory, motion.trajectory.duration)
        except (Collides, TorqueExceeded):
            return None
        return motion

    def _first(self, estimator: Estimator, start: State, target: np.ndarray) -> Iterator[Choice]:
        """Yield hits that are not earlier than the variant demands; if none of them can be played, earlier ones.

        Raises NoHit if there are none at all.
        """
        path = estimator.path(start.time + HORIZON_S)
        until, found = np.inf, False
        for earliest in (*np.arange(self.variant.earliest, 0.7, -0.05), -np.inf):
            try:
                choices = self._chooser.choose(path, start, target, earliest=float(earliest), count=CANDIDATES)
            except NoHit:
                if np.isneginf(earliest) and not found:
                    raise
                continue
            for choice in distinct_first(choices):
                if choice.time < until:
                    found = True
                    yield choice
            until = earliest

    def _action(self, observation: np.ndarray, motions: list[Motion], now: float) -> np.ndarray:
        """Return the torques, relative to the motors' maximum, that track the reference over the coming 8 ms."""
        positions, velocities = observation[:7], observation[7:14]
        current = next((motion for motion in reversed(motions) if motion.start <= now + 1e-9), None)
        if current is None:
            home = self._config.home
            reference, after = State(now, home, 0 * home, 0 * home), np.zeros(7)
        else:
            reference, after = current.state(now), current.state(now + CONTROL_S).velocities
        pull = (after - reference.velocities) / CONTROL_S
        pull = pull + OMEGA**2 * (reference.positions - positions)
        pull = pull + DAMPING * OMEGA * (reference.velocities - velocities)
        return self._motors.action(velocities, pull, (reference.velocities + after) / 2)

    def _judge(self, result: Ball, info: dict[str, Any], motions: list[Motion], now: float) -> None:
        result.hit, result.returned = bool(info["hit_ball"]), bool(info["ball_returned_success"])
        result.success = bool(info["is_success"])
        if result.returned:
            result.error = float(info["land_dist_error"])
        result.violations = violations(self._limits, motions, now) if motions else 0
        # A ball that the racket has missed may push another part of the arm.
        times, positions = self._arm_check.judge(result, motions[-1].hit if motions else np.inf)
        result.off_plan = distance(motions, times, positions)

    def _learn(self, choice: Choice, after: list[tuple[float, np.ndarray]]) -> None:
        used = [(time, place) for time, place in after if time > choice.time + 0.012]
        found = outgoing_velocity([t for t, _ in used], np.array([p for _, p in used]), choice.time, BALL, Air())
        if found is None:
            return
        velocity, std = found
        self.learner.observe(choice, BALL.mass, velocity, max(std, 0.02), choice.law_error)


def _ms_since(began: float) -> float:
    return round(1e3 * (clock.thread_time() - began), 2)


def _sign(rng: np.random.Generator) -> int:
    return 1 if rng.uniform() < 0.5 else -1
