"""The simulated arm: a robot's backend in MuJoCo, and its ball."""

import math
from collections.abc import Mapping

import mujoco
import numpy as np

from protocol.errors import Refusal
from protocol.messages import ActiveDisturbance, Ball, Contact, Disturb
from robot.checking.checks import check_robot
from robot.checking.subject import Finding
from robot.description import RobotConfig
from robot.surroundings import Surroundings
from services.common.robot_side.backend import Abilities, Backend, Observation, RobotFailed, Setpoint
from services.sim.contact import ContactLog
from services.sim.disturbances import Disturbances
from services.sim.guiding import Guidance
from services.sim.held import HeldJoints
from services.sim.inverse_dynamics import InverseDynamics
from services.sim.led import LedJoints
from services.sim.model import Scene, build_scene

TEE_STORE = (0.0, 0.0, -10.0)
"""Where the tee is kept while the ball needs none, m."""

BALL_REACH = 100.0
"""A ball is placed within this distance (m) of the origin on each axis, at this speed (m/s) at most."""


class Diverged(RobotFailed):
    """The simulation has no finite state any more."""


class SimulatedArm(Backend):
    """A torque-driven arm in MuJoCo. The same seed and the same calls give the same bits."""

    abilities = Abilities(modes=("torque", "teach"))

    def __init__(self, config: RobotConfig, seed: int = 0) -> None:
        self.config = config
        self._scene: Scene = build_scene(config)
        self._held = HeldJoints(config, self._scene)
        self._controlled = np.concatenate([self._scene.dofs, self._held.dofs])
        self._dynamics = InverseDynamics(self._scene, self._controlled)
        self._torque_limits = np.concatenate([config.torques, self._held.limits])
        self._contact_log = ContactLog(self._scene)
        self._surroundings = Surroundings(config, self._scene.model)
        self._led = LedJoints(self._scene)
        self._disturbances = Disturbances(config)
        self.reset(seed=seed)

    def reset(self, positions: list[float] | None = None, ball: Ball | None = None, seed: int = 0) -> None:
        """Tick 0, at rest at `positions` (J,), rad (None: home), undisturbed, the ball where given (None: on its tee).

        A ball given at rest gets the tee under it. Raises Refusal `bad_message` for a wrong length, numbers that are
        not finite, a ball out of reach or a negative seed, `limit` for a joint outside its range; nothing has changed
        then.
        """
        if seed < 0:
            raise Refusal("bad_message", f"seed is {seed}; it must be 0 or more", field="seed")
        pose = self.config.home if positions is None else self._checked_pose(positions)
        self._check_ball(ball)
        scene = self._scene
        mujoco.mj_resetData(scene.model, scene.data)
        scene.data.qpos[scene.qpos] = pose
        self._held.reset()
        if ball is not None:
            self._place_ball(ball)
        self._noise = np.random.default_rng(seed)
        self.begin_run()

    def begin_run(self) -> None:
        """Tick 0 where the arm stands, undisturbed; the ball goes on."""
        self._disturbances.clear()
        self._contact_log.clear()
        self._guidance: Guidance | None = None
        self._tick = 0
        self._torques = np.zeros(self.config.joint_count)
        self._saturated = np.zeros(self.config.joint_count, dtype=bool)
        self._contacts: list[Contact] = []
        self._observation = self._measure()

    def step(self, setpoint: Setpoint) -> None:
        """One tick with the setpoint's accelerations: torque by inverse dynamics, held for the tick.

        An arm that is guided ignores the setpoint: the hand and the motors together move it as `Guidance` says.

        Raises ValueError, before anything moves, where they are not J finite numbers, and Diverged.
        """
        scene = self._scene
        model, data = scene.model, scene.data
        self._led.place()
        mujoco.mj_step1(model, data)
        pushes, accelerations = self._pushes(), setpoint.accelerations
        if self._guidance:
            pushed = self._dynamics.free(pushes)
            accelerations = self._guidance.accelerations(data.qpos[scene.qpos], data.qvel[scene.dofs], pushed)
        demanded = self._dynamics.torques(np.concatenate([accelerations, self._held.accelerations()]))
        if not math.isfinite(demanded.sum()):
            raise ValueError(f"accelerations: {accelerations} cannot be turned into torques; they must be finite")
        limits, joints = self._torque_limits, self.config.joint_count
        if self._guidance:
            demanded[:joints] -= pushes
        torques = np.minimum(np.maximum(demanded, -limits), limits)  # np.clip takes three times as long
        self._torques = torques[:joints]
        self._saturated = self._torques != demanded[:joints]
        data.qfrc_applied[self._controlled] = demanded if self._guidance else torques
        data.qfrc_applied[scene.dofs] += pushes
        self._contacts = []
        for substep in range(scene.substeps):
            if substep:
                mujoco.mj_step1(model, data)
            self._advance(self._observation.time + substep * model.opt.timestep)
        self._tick += 1
        self._observation = self._measure()
        if not math.isfinite(data.qvel[scene.dofs].sum()):
            raise Diverged(f"the physics diverged at {self._observation.time:.3f} s; ask for weaker pushes")

    def check(self) -> list[Finding]:
        """What is wrong with the robot and its model."""
        return check_robot(self.config, self._scene.model)

    def observe(self) -> Observation:
        """The arm at the present tick; the same object until the next step."""
        return self._observation

    def guide(self) -> None:
        """Yield to pushes, weightless, until `recover`."""
        self._guidance = Guidance(self.config, self._scene.data.qpos[self._scene.qpos])
        self._observation = self._measure()

    def recover(self) -> None:
        """Follow setpoints again."""
        self._guidance = None
        self._observation = self._measure()

    def disturb(self, request: Disturb) -> float:
        """Begin a disturbance of any kind but `loss`; returns when it begins, s.

        Raises Refusal `bad_message` for fields that are missing, of another kind, or out of range.
        """
        kind = request.kind
        if kind in ("loss", "ball_noise"):
            raise Refusal("bad_message", f"kind: {kind!r} is none of the arm's own", field="kind")
        if kind == "sensor_noise":
            self._disturbances.set_sensor_noise(request.position_std or 0.0, request.velocity_std or 0.0)
            return self._tick / self.config.rate_hz
        for field in ("values", "duration"):
            if getattr(request, field) is None:
                raise Refusal("bad_message", f"{field} is missing; kind {kind!r} needs it", field=field)
        assert request.values is not None
        assert request.duration is not None
        return self._disturbances.push(kind, request.values, request.start_time, request.duration, self._tick)

    def hold(self, targets: Mapping[str, float]) -> float:
        """Begin to lead held joints to new values, rad or m by name; return how long that takes, s."""
        return self._held.lead(targets)

    def disturbances(self) -> list[ActiveDisturbance]:
        """What acts on the arm in the coming tick."""
        return self._disturbances.describe(self._tick)

    def contacts(self) -> list[Contact]:
        """The contacts that began or ended in the tick before."""
        return self._contacts

    def ball(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Position and velocity of the ball, (3,) each, m and m/s; None in a scene without one."""
        ball, data = self._scene.ball, self._scene.data
        if ball is None:
            return None
        return data.qpos[ball.qpos : ball.qpos + 3].copy(), data.qvel[ball.dof : ball.dof + 3].copy()

    def lead(self, joints: tuple[str, ...], positions: list[float], velocities: list[float]) -> None:
        """Take the newest positions and velocities of another robot's joints, rad and rad/s; nothing holds them now."""
        begun = self._led.lead(joints, positions, velocities)
        if begun is not None:
            self._torque_limits[np.isin(self._controlled, begun)] = 0.0

    def surroundings(self) -> dict[str, list[float]]:
        """Coordinates of the joints that are neither the arm's nor the ball's, by name."""
        return self._surroundings.read(self._scene.data)

    def _advance(self, start_time: float) -> None:
        """Finish the physics step that begins at `start_time`, s.

        MuJoCo moves positions with the velocities after the step, which leads an acceleration held over the
        step by h/2·a·h; with the mean of the velocities before and after, the arm's positions are exact.
        """
        scene = self._scene
        data = scene.data
        before = data.qvel[scene.dofs]
        mujoco.mj_step2(scene.model, data)
        data.qpos[scene.qpos] -= scene.model.opt.timestep / 2 * (data.qvel[scene.dofs] - before)
        self._contacts += self._contact_log.update(start_time)

    def _pushes(self) -> np.ndarray:
        """Generalised forces (J,), N·m, of the pushes that act now."""
        joints = self.config.joint_count
        total = np.zeros(joints)
        for push in self._disturbances.acting(self._tick):
            if push.kind == "acceleration":
                total += self._dynamics.inertial(np.pad(push.values, (0, len(self._controlled) - joints)))[:joints]
            else:
                total += push.values
        return total

    def _measure(self) -> Observation:
        scene, noise = self._scene, self._disturbances
        true_positions, true_velocities = scene.data.qpos[scene.qpos], scene.data.qvel[scene.dofs]
        positions, velocities = true_positions, true_velocities
        if noise.position_std or noise.velocity_std:
            draws = self._noise.standard_normal((2, self.config.joint_count))
            positions = positions + noise.position_std * draws[0]
            velocities = velocities + noise.velocity_std * draws[1]
        return Observation(
            tick=self._tick,
            time=self._tick / self.config.rate_hz,
            positions=positions,
            velocities=velocities,
            torques=self._torques,
            saturated=self._saturated,
            true_positions=true_positions,
            true_velocities=true_velocities,
            held=self._held.positions(),
            condition="guiding" if self._guidance else "ready",
        )

    def _checked_pose(self, positions: list[float]) -> np.ndarray:
        config = self.config
        if len(positions) != config.joint_count:
            message = f"positions has {len(positions)} numbers; the arm has {config.joint_count} joints"
            raise Refusal("bad_message", message, field="positions")
        for name, value, (low, high) in zip(config.joint_names, positions, config.limits.positions, strict=True):
            if not np.isfinite(value):
                raise Refusal("bad_message", f"positions: {name} is {value}; it must be finite", field="positions")
            if not low <= value <= high:
                message = f"positions: {name} at {value:.6g} rad lies outside its range {low:.6g} to {high:.6g}"
                bound = float(low if value < low else high)
                raise Refusal("limit", message, joint=name, quantity="position", value=value, bound=bound)
        return np.array(positions, dtype=float)

    def _check_ball(self, ball: Ball | None) -> None:
        if ball is None:
            return
        if self._scene.ball is None:
            raise Refusal("bad_message", "ball: this robot's scene has none; leave it null", field="ball")
        if not np.all(np.abs([*ball.position, *ball.velocity]) <= BALL_REACH):
            message = f"ball: position and velocity must lie within {BALL_REACH:g} (m, m/s) of 0 on each axis"
            raise Refusal("bad_message", message, field="ball")

    def _place_ball(self, ball: Ball) -> None:
        scene = self._scene
        free = scene.ball
        assert free is not None
        scene.data.qpos[free.qpos : free.qpos + 3] = ball.position
        scene.data.qvel[free.dof : free.dof + 3] = ball.velocity
        if scene.tee is not None:
            x, y, z = ball.position
            scene.data.mocap_pos[scene.tee] = TEE_STORE if any(ball.velocity) else (x, y, z - free.radius)
