"""Plays balls of the environment: sees, chooses, plans, tracks, corrects, learns."""

import time as clock
from dataclasses import dataclass, field, replace
from pathlib import Path as Folder
from typing import Any

import mujoco
import numpy as np

from benchmarks.table_tennis.motions import Method, Motion, make_motion, violations
from benchmarks.table_tennis.scene import BALL, CONTROL_S, GEARS, OFFSET, RACKET, court, environment, robot
from motion.demonstration import Demonstration
from motion.primitive import Primitive, learn
from robot.model import joint_ids
from robot.motion_check import Collides, MotionCheck
from robot.striking.arm import Arm
from robot.striking.calibration import calibrate
from robot.striking.choice import Choice, NoHit, State
from robot.striking.chooser import Chooser, Options
from robot.striking.contact import ContactLaw
from robot.striking.estimator import Belief, Estimator
from robot.striking.flight import Air
from robot.striking.learning import Learner, left_with
from robot.striking.path import Path
from robot.striking.reachability import Reachability
from robot.striking.simulated_contact import SimulatedContact

FIRST_S = 0.1
"""The first choice is made then, …"""
LATENCY_S = 0.008
"""… and a new motion begins so long after the sight it is made from."""
CANDIDATES = 24
"""Hits that are planned one after the other until one is inside the limits and touches nothing."""
UNTIL_S = 0.05
"""No correction begins later before the touch."""
OMEGA, DAMPING = 40.0, 1.4
"""Of the tracking: ω², and 1.4 ω."""


@dataclass(frozen=True, slots=True)
class Variant:
    """Conditions.

    environment: fancy_gym's class. noise: m, of each sight. table, racket: the parts by which the restitutions believed
    are wrong, the sign by chance. corrected: after the first choice. learns: from outgoing balls. scale: of the limits.
    period: s between corrections, or attempts to choose. earliest: s, when the hit should be at the soonest. wind: it
    blows, and velocities are seen. simulated: hits are chosen with a simulated contact. options: of the chooser.
    """

    name: str
    environment: str = "TableTennisEnv"
    method: Method = "qp"
    noise: float = 0.0
    table: float = 0.0
    racket: float = 0.0
    corrected: bool = True
    learns: bool = False
    scale: float = 1.0
    period: float = 0.032
    earliest: float = 0.0
    wind: bool = False
    simulated: bool = True
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(slots=True)
class Ball:
    """What became of one: planned at all, judged by the environment, error (m), and how it was played."""

    planned: bool = False
    hit: bool = False
    returned: bool = False
    success: bool = False
    error: float = np.nan
    violations: int = 0
    corrections: int = 0
    refused: int = 0
    first_ms: float = np.nan
    correction_ms: list[float] = field(default_factory=list, repr=False)
    note: str = ""


class Player:
    """Plays one variant. seed: of the noise, and of which way beliefs are wrong."""

    def __init__(self, variant: Variant, folder: Folder, seed: int) -> None:
        self.variant = variant
        self._rng = np.random.default_rng(seed)
        self._env: Any = environment(variant.environment)
        self._config = config = robot(folder, variant.scale)
        self._limits = config.limits
        self._arm = Arm(config, RACKET, BALL)
        self._table = Reachability.of(config, folder)
        nothing = SimulatedContact(config, "target_ball", ContactLaw(0.0, 0.0), self._arm.offset)
        law = calibrate(self._arm, self._table, nothing).law
        exact = not variant.noise and not variant.racket
        self._contact = SimulatedContact(config, "target_ball", law, self._arm.offset, *(((),) if exact else ()))
        self._law = law
        wrong = self._sign() * variant.racket
        believed = ContactLaw(law.restitution * (1 + wrong), law.friction, law.duration)
        self.learner = Learner.of(believed)
        self._chooser = Chooser(
            self._arm,
            self._table,
            court(),
            believed,
            Options(**variant.options),
            self._contact if variant.simulated else None,
        )
        self._check = MotionCheck(config)
        self._model = self._env.unwrapped.model
        self._data = mujoco.MjData(self._model)
        joints = joint_ids(self._model, config.joint_names)
        self._dofs = self._model.jnt_dofadr[joints]
        self._damping = self._model.dof_damping[self._dofs]
        self._full = np.zeros((self._model.nv, self._model.nv))
        self.primitive = self._demonstration()

    def play(self, seed: int) -> Ball:
        """Play the ball of a seed."""
        variant, env = self.variant, self._env
        believed = court(1 + self._sign() * variant.table)
        wind = (1.0, 1.0, 0.0) if variant.wind else (0.0, 0.0, 0.0)
        belief = Belief(
            max(variant.noise, 1e-6),
            velocity_std=1e-6,
            restitution_std=0.08 if variant.table else 1e-4,
            wind_std=wind,
            unmodelled=0.02 if variant.noise else 1e-4,
        )
        estimator = Estimator(BALL, believed, belief)
        estimator.reset()
        self._chooser.law = self.learner.law
        result, motions = Ball(), list[Motion]()
        choice: Choice | None = None
        planned_at = -np.inf
        after: list[tuple[float, np.ndarray]] = []
        observation, _ = env.reset(seed=seed)
        now, done, info = 0.0, False, {}
        target = np.zeros(3)
        while not done:
            target = np.append(observation[-2:], believed.surface.height)
            place = observation[14:17] + np.array([0.0, 0.0, OFFSET])
            seen = place + variant.noise * self._rng.normal(size=3)
            # Only to know which sights are of the outgoing ball.
            if env.unwrapped._hit_ball:
                after.append((now, seen))
            else:
                velocity = observation[17:20] if variant.wind else None
                estimator.observe(now, seen, velocity)
                wanted = now >= FIRST_S - 1e-9 if choice is None else variant.corrected
                due = now - planned_at >= variant.period - 1e-9
                late = choice is not None and now + LATENCY_S > choice.time - UNTIL_S
                if wanted and due and not late:
                    planned_at = now
                    choice = self._decide(estimator, motions, now, target, choice, result) or choice
            observation, _, done, _, info = env.step(self._action(observation, motions, now))
            now += CONTROL_S
        self._judge(result, info, motions, now)
        if choice is not None and variant.learns and result.hit:
            self._learn(choice, after)
        return result

    def _sign(self) -> int:
        return 1 if self._rng.uniform() < 0.5 else -1

    def _decide(
        self,
        estimator: Estimator,
        motions: list[Motion],
        now: float,
        target: np.ndarray,
        last: Choice | None,
        result: Ball,
    ) -> Choice | None:
        """Choose or correct, and plan; return the hit that is played from now on, None where nothing changes."""
        begin = now + LATENCY_S
        began = clock.thread_time()
        try:
            path = estimator.path(now + 1.5 if last is None else last.time + 0.1)
            if last is None:
                home = self._config.home
                start = State(begin, home, np.zeros_like(home), np.zeros_like(home))
                choices = self._first(path, start, target)
                phase = 0.0
            else:
                start = motions[-1].state(begin)
                choices = self._chooser.correct(path, start, target, last)
                phase = motions[-1].phase_at(begin)
        except NoHit as error:
            result.note = error.reason
            result.refused += 1
            return None
        spent = 1e3 * (clock.thread_time() - began)
        if last is None:
            result.first_ms = spent
        else:
            result.correction_ms.append(spent)
        for rank, choice in enumerate(choices):
            motion = self._motion(start, choice, phase)
            if motion is not None and last is None and rank:
                finer = self._chooser.refined(choice, start)
                again = self._motion(start, finer, phase)
                choice, motion = (choice, motion) if again is None else (finer, again)
            if motion is not None:
                motions.append(motion)
                result.planned = True
                result.corrections += last is not None
                return choice
        result.refused += 1
        result.note = "plan"
        return None

    def _motion(self, start: State, choice: Choice, phase: float) -> Motion | None:
        """Return the motion to a hit, None where it is refused, or the arm touched itself or the table."""
        motion = make_motion(self.variant.method, self.primitive, self._limits, start, choice, phase)
        try:
            if motion is not None:
                self._check.check(motion.trajectory, motion.trajectory.duration, torque=False)
        except Collides:
            return None
        return motion

    def _first(self, path: Path, start: State, target: np.ndarray) -> list[Choice]:
        """Return hits not sooner than the variant asks for, as near to that as there are any."""
        for earliest in np.arange(self.variant.earliest, 0.7, -0.05):
            try:
                return self._chooser.choose(path, start, target, earliest=float(earliest), count=CANDIDATES)
            except NoHit:
                continue
        return self._chooser.choose(path, start, target, count=CANDIDATES)

    def _action(self, observation: np.ndarray, motions: list[Motion], now: float) -> np.ndarray:
        """Return the torques, as parts of the motors' own, that track the reference over the coming 8 ms."""
        positions, velocities = observation[:7], observation[7:14]
        current = next((motion for motion in reversed(motions) if motion.start <= now + 1e-9), None)
        if current is None:
            home = self._config.home
            reference, after = State(now, home, 0 * home, 0 * home), np.zeros(7)
        else:
            reference, after = current.state(now), current.state(now + CONTROL_S).velocities
        model, data = self._model, self._data
        data.qpos[:] = self._env.unwrapped.data.qpos
        data.qvel[:] = 0
        data.qvel[self._dofs] = velocities
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, self._full)
        mass = self._full[np.ix_(self._dofs, self._dofs)]
        pull = (after - reference.velocities) / CONTROL_S
        pull = pull + OMEGA**2 * (reference.positions - positions)
        pull = pull + DAMPING * OMEGA * (reference.velocities - velocities)
        bias = data.qfrc_bias[self._dofs]
        torque = mass @ pull + bias + self._damping * reference.velocities
        return np.clip(torque / GEARS, -1.0, 1.0)

    def _judge(self, result: Ball, info: dict[str, Any], motions: list[Motion], now: float) -> None:
        result.hit, result.returned = bool(info["hit_ball"]), bool(info["ball_returned_success"])
        result.success = bool(info["is_success"])
        if result.returned:
            result.error = float(info["land_dist_error"])
        result.violations = violations(self._limits, motions, now) if motions else 0

    def _learn(self, choice: Choice, after: list[tuple[float, np.ndarray]]) -> None:
        used = [(time, place) for time, place in after if time > choice.time + 0.012]
        found = left_with([t for t, _ in used], np.array([p for _, p in used]), choice.time, BALL, Air())
        if found is None:
            return
        velocity, std = found
        self.learner.observe(choice, BALL.mass, velocity, max(std, 0.02), choice.beside)

    def _demonstration(self) -> Primitive:
        """Return a strike at a ball in the middle, as a quintic: what a person would show."""
        estimator = Estimator(BALL, court(), Belief(1e-6, restitution_std=1e-4))
        for time in (0.0, 0.008):
            flown = np.array([2.5, 0.0, 0.5]) * time - [0, 0, 9.81 * time * (time + BALL.step) / 2]
            estimator.observe(time, np.array([-0.6, 0.0, 1.85]) + flown)
        home = self._config.home
        start = State(FIRST_S, home, 0 * home, 0 * home)
        chooser = Chooser(self._arm, self._table, court(), self._law, replace(Options(), use=2.0))
        choice = chooser.choose(estimator.path(1.5), start, np.array([-0.6, 0.0, 0.77]))[0]
        times = np.linspace(0, choice.goal_time - FIRST_S, 200)
        s = (times / times[-1])[:, None]
        way, arrival = choice.positions - home, choice.velocities * times[-1]
        positions = home + s**3 * (way * (10 - 15 * s + 6 * s**2) + arrival * (-4 + 7 * s - 3 * s**2))
        return learn(Demonstration(times, positions))
