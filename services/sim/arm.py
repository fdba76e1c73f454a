"""The simulated arm: a robot's backend in MuJoCo, and its ball."""

import math
from collections.abc import Mapping

import numpy as np

from protocol.codec import bad_message
from protocol.errors import Refusal
from protocol.messages import ActiveDisturbance, Ball, BallState, BallTruth, Contact, Disturb, Throw
from robot.checking.checks import check_robot
from robot.checking.subject import Finding
from robot.description import RobotConfig
from robot.surroundings import Surroundings
from services.common.robot_side.backend import Abilities, Backend, Observation, RobotFailed, Setpoint
from services.sim.ball import SimulatedBall, check_reach
from services.sim.camera import Camera
from services.sim.contact import ContactLog
from services.sim.disturbances import Disturbances
from services.sim.guiding import Guidance
from services.sim.held import HeldJoints
from services.sim.inverse_dynamics import InverseDynamics
from services.sim.led import LedJoints
from services.sim.model import Scene, arm_in
from services.sim.world import World


class Diverged(RobotFailed):
    """The simulation has no finite state any more."""


class SimulatedArm(Backend):
    """A torque-driven arm in MuJoCo. The same seed and the same calls give the same bits.

    In a world of several arms a tick passes once each of them has been given its step.
    """

    abilities = Abilities(modes=("torque", "teach"))

    def __init__(self, config: RobotConfig, seed: int = 0, world: World | None = None) -> None:
        """`world`: where it stands; by default one of its own."""
        self.config = config
        self._world = world = world or World([config])
        self.scene: Scene = arm_in(world.scene, config)
        self._held = HeldJoints(config, self.scene, {k: v for k, v in config.held.items() if k not in world.joints})
        self._controlled = np.concatenate([self.scene.dofs, self._held.dofs])
        self._dynamics = InverseDynamics(self.scene, self._controlled)
        self._torque_limits = np.concatenate([config.torques, self._held.limits])
        self._contact_log = ContactLog(self.scene)
        self._surroundings = Surroundings(config, self.scene.model)
        self._led = LedJoints(self.scene)
        self._disturbances = Disturbances(config)
        self._ball = world.ball
        self._camera = Camera(config.rate_hz, config.ball.every if config.ball else 1)
        self._setpoint: Setpoint | None = None
        world.join(self, self.scene.qpos, self.scene.dofs)
        self.reset(seed=seed)

    def reset(self, positions: list[float] | None = None, ball: Ball | None = None, seed: int = 0) -> None:
        """Tick 0, at rest at `positions` (J,), rad (None: home), undisturbed, the ball where given (None: on its tee).

        A ball given at rest gets the tee under it. Raises Refusal `bad_message` for a wrong length, numbers that are
        not finite, a ball out of reach or a negative seed, `limit` for a joint outside its range; nothing has changed
        then.
        """
        if seed < 0:
            raise bad_message("seed", f"seed is {seed}; it must be 0 or more")
        pose = self.config.home if positions is None else self._checked_pose(positions)
        self._check_ball(ball)
        scene = self.scene
        self._world.reset(self)
        scene.data.qpos[scene.qpos] = pose
        self._held.reset()
        if ball is not None and self._ball is not None:
            self._ball.put(ball)
        self._noise = np.random.default_rng(seed)
        self._camera.clear(seed)
        self.begin_run()

    def begin_run(self) -> None:
        """Tick 0 where the arm stands, undisturbed; the ball goes on."""
        self._disturbances.clear()
        self._camera.clear()
        if self._ball is not None:
            self._ball.calm()
        self._contact_log.clear()
        self._guidance: Guidance | None = None
        self._tick = 0
        self._torques = np.zeros(self.config.joint_count)
        self._saturated = np.zeros(self.config.joint_count, dtype=bool)
        self._contacts: list[Contact] = []
        self._observation = self._measure()

    def step(self, setpoint: Setpoint) -> None:
        """One tick with the setpoint's accelerations: torque by inverse dynamics, held for the tick.

        Where other arms share the world, the tick passes with the last one's step.

        An arm that is guided ignores the setpoint: the hand and the motors together move it as `Guidance` says.

        Raises ValueError, before anything moves, where they are not J finite numbers, and Diverged.
        """
        if not math.isfinite(setpoint.accelerations.sum()):
            raise ValueError(f"accelerations: {setpoint.accelerations} cannot be turned into torques; must be finite")
        self._setpoint = setpoint
        self._world.step()

    def is_set(self) -> bool:
        """Return whether it has its setpoint for the coming tick."""
        return self._setpoint is not None

    def place_led(self) -> None:
        """Put the joints of robots that another process moves where their states have them."""
        self._led.place()

    def drive(self) -> None:
        """Turn the setpoint into torques, by inverse dynamics, and apply them."""
        assert self._setpoint is not None
        scene, data = self.scene, self.scene.data
        pushes, accelerations = self._pushes(), self._setpoint.accelerations
        if self._guidance:
            pushed = self._dynamics.free(pushes)
            accelerations = self._guidance.accelerations(data.qpos[scene.qpos], data.qvel[scene.dofs], pushed)
        limits, joints = self._torque_limits, self.config.joint_count
        held, corrections = self._held.accelerations()
        demanded = self._dynamics.torques(np.concatenate([accelerations, held]))
        if len(held):  # a finger that an object stops does not move, so its servo must not move the arm
            demanded[joints:] += self._dynamics.servo(corrections)
        if self._guidance:
            demanded[:joints] -= pushes
        torques = np.minimum(np.maximum(demanded, -limits), limits)  # np.clip takes three times as long
        self._torques = torques[:joints]
        self._saturated = self._torques != demanded[:joints]
        data.qfrc_applied[self._controlled] = demanded if self._guidance else torques
        data.qfrc_applied[scene.dofs] += pushes
        self._contacts = []

    def take_contacts(self, substep: int) -> None:
        """Take in the contacts of a physics step, the `substep`-th of the tick."""
        self._contacts += self._contact_log.update(self._observation.time + substep * self.scene.model.opt.timestep)

    def finish(self) -> None:
        """Measure, and count the tick.

        Raises:
            Diverged: the state is not finite.
        """
        self._setpoint = None
        self._tick += 1
        self._observation = self._measure()
        if not math.isfinite(self.scene.data.qvel[self.scene.dofs].sum()):
            raise Diverged(f"the physics diverged at {self._observation.time:.3f} s; ask for weaker pushes")

    def check(self) -> list[Finding]:
        """What is wrong with the robot and its model."""
        return check_robot(self.config, self.scene.model)

    def observe(self) -> Observation:
        """The arm at the present tick; the same object until the next step."""
        return self._observation

    def guide(self) -> None:
        """Yield to pushes, weightless, until `recover`."""
        self._guidance = Guidance(self.config, self.scene.data.qpos[self.scene.qpos])
        self._observation = self._measure()

    def recover(self) -> None:
        """Follow setpoints again."""
        self._guidance = None
        self._observation = self._measure()

    def disturb(self, request: Disturb) -> float:
        """Begin a disturbance of any kind but `loss`; returns when it begins, s.

        Raises Refusal `bad_message` for fields that are missing, of another kind, or out of range.
        """
        match request.kind:
            case "sensor_noise":
                self._disturbances.set_sensor_noise(request.position_std or 0.0, request.velocity_std or 0.0)
            case "ball_noise":
                self._refuse_without_ball("kind")
                self._camera.disturb(request)
            case "wind":
                self._refuse_without_ball("kind").blow(request)
            case _:
                return self._disturbances.push(request, self._tick)
        return self._tick / self.config.rate_hz

    def hold(self, targets: Mapping[str, float]) -> float:
        """Begin to lead held joints to new values, rad or m by name; return how long that takes, s."""
        return self._held.lead(targets)

    def disturbances(self) -> list[ActiveDisturbance]:
        """What acts on the arm in the coming tick."""
        wind = self._ball.describe() if self._ball else []
        return self._disturbances.describe(self._tick) + self._camera.describe() + wind

    def contacts(self) -> list[Contact]:
        """The contacts that began or ended in the tick before."""
        return self._contacts

    def throw(self, throw: Throw) -> float:
        """Put the ball in flight, in the run that goes on; return since when, s.

        Raises Refusal `bad_message` where the scene has no ball, or it cannot begin there.
        """
        self._refuse_without_ball("position").throw(throw)
        return self._tick / self.config.rate_hz

    def ball(self) -> BallTruth | None:
        """The ball in the world frame; None in a scene without one."""
        return None if self._ball is None else self._ball.state()

    def sights(self) -> list[BallState]:
        """What has arrived of the ball at the present tick, as a camera sees it; call it once a tick."""
        if self._ball is not None and self._camera.sees(self._tick):
            self._camera.see(self._tick, self._ball.state())
        return self._camera.take(self._tick)

    def lead(self, joints: tuple[str, ...], positions: list[float], velocities: list[float]) -> None:
        """Take the newest positions and velocities of another robot's joints, rad and rad/s; nothing holds them now."""
        begun = self._led.lead(joints, positions, velocities)
        if begun is not None:
            self._torque_limits[np.isin(self._controlled, begun)] = 0.0

    def surroundings(self) -> dict[str, list[float]]:
        """Coordinates of the joints that are neither the arm's nor the ball's, by name."""
        return self._surroundings.read(self.scene.data)

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
        scene, noise = self.scene, self._disturbances
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
            sentence = f"positions has {len(positions)} numbers; the arm has {config.joint_count} joints"
            raise bad_message("positions", sentence)
        for name, value, (low, high) in zip(config.joint_names, positions, config.limits.positions, strict=True):
            if not np.isfinite(value):
                raise bad_message("positions", f"positions: {name} is {value}; it must be finite")
            if not low <= value <= high:
                message = f"positions: {name} at {value:.6g} rad lies outside its range {low:.6g} to {high:.6g}"
                bound = float(low if value < low else high)
                raise Refusal("limit", message, joint=name, quantity="position", value=value, bound=bound)
        return np.array(positions, dtype=float)

    def _check_ball(self, ball: Ball | None) -> None:
        if ball is not None:
            self._refuse_without_ball("ball")
            check_reach(ball=ball.position)
            check_reach(ball=ball.velocity)

    def _refuse_without_ball(self, field: str) -> SimulatedBall:
        """Return the ball. Raises Refusal `bad_message` where there is none."""
        if self._ball is None:
            cure = 'add a body "ball" with a free joint to its model' if field != "ball" else "leave it null"
            raise bad_message(field, f"{field}: this robot's scene has no ball; {cure}")
        return self._ball
