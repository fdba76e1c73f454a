"""The simulated arm: a backend in MuJoCo, with its ball."""

import math
from collections.abc import Mapping

import numpy as np

from protocol.codec import bad_message
from protocol.errors import Refusal
from protocol.messages import ActiveDisturbance, Ball, BallState, BallTruth, Contact, Disturb, Throw
from robot.checking.checks import check_robot
from robot.checking.subject import Finding
from robot.conversions import unit_of
from robot.description import RobotConfig
from robot.surroundings import Surroundings
from services.common.robot_side.backend import Abilities, Backend, Observation, RobotFailed, Setpoint
from services.sim.ball import SimulatedBall, check_reach
from services.sim.camera import Camera
from services.sim.contact import ContactLog
from services.sim.disturbances import Disturbances, check_fields
from services.sim.guiding import Guidance
from services.sim.held import HeldJoints
from services.sim.inverse_dynamics import InverseDynamics
from services.sim.led import LedJoints
from services.sim.model import Scene, scene_of
from services.sim.world import World


class Diverged(RobotFailed):
    """The simulation's state is no longer finite."""


class SimulatedArm(Backend):
    """A torque-driven arm in MuJoCo. Equal seeds and calls give bit-identical results.

    In a world of several arms a tick passes when each of them has received its step.
    """

    abilities = Abilities(modes=("torque", "teach"))

    def __init__(self, config: RobotConfig, seed: int = 0, world: World | None = None) -> None:
        """`world`: world that the arm shares with others; by default a new one."""
        self.config = config
        self._world = world = world or World([config])
        self.scene: Scene = scene_of(world.scene, config)
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
        """Reset to tick 0, at rest at `positions` (J,), rad (None: home), undisturbed; `ball` None: on its tee.

        A ball at rest gets the tee under it. Raises Refusal: `bad_message` for a wrong length, numbers that are not
        finite, a ball out of reach or a negative seed; `limit` for a joint outside its range. Nothing has changed
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
        """Reset to tick 0 at the arm's present pose, undisturbed; the ball's motion continues."""
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
        """Advance a tick with the setpoint's accelerations: torque by inverse dynamics, held for the tick.

        If other arms share the world, the tick passes with the last arm's step.

        A guided arm ignores the setpoint: hand and motors together move it, as in `Guidance`.

        Raises ValueError, before anything moves, if the accelerations are not J finite numbers, and Diverged.
        """
        if not math.isfinite(setpoint.accelerations.sum()):
            raise ValueError(f"accelerations: {setpoint.accelerations} cannot be turned into torques; must be finite")
        self._setpoint = setpoint
        self._world.step()

    def is_set(self) -> bool:
        """Return whether the arm has its setpoint for the coming tick."""
        return self._setpoint is not None

    def place_led(self) -> None:
        """Set the joints of robots of other processes to their newest states."""
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
        if len(held):  # an object may stop a finger, so its servo must not accelerate the arm
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
        """Process the contacts of a physics step, the `substep`-th of the tick."""
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
        """Faults of the robot and its model."""
        return check_robot(self.config, self.scene.model)

    def observe(self) -> Observation:
        """Return the arm at the present tick; the same object until the next step."""
        return self._observation

    def guide(self) -> None:
        """Make the arm weightless and compliant until `recover`."""
        self._guidance = Guidance(self.config, self.scene.data.qpos[self.scene.qpos])
        self._observation = self._measure()

    def recover(self) -> None:
        """Follow setpoints again."""
        self._guidance = None
        self._observation = self._measure()

    def disturb(self, request: Disturb) -> float:
        """Start a disturbance of any kind but `loss`; return its start time, s.

        Raises Refusal `bad_message` for fields that are missing, of another kind, or out of range.
        """
        check_fields(request)
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
        """Start to move held joints to new values, rad or m by name; return the duration, s."""
        return self._held.lead(targets)

    def disturbances(self) -> list[ActiveDisturbance]:
        """Disturbances that act on the arm in the coming tick."""
        wind = self._ball.describe() if self._ball else []
        return self._disturbances.describe(self._tick) + self._camera.describe() + wind

    def contacts(self) -> list[Contact]:
        """Contacts that began or ended in the last tick."""
        return self._contacts

    def throw(self, throw: Throw) -> float:
        """Throw the ball, in the present run; return the start time of its flight, s.

        Raises Refusal `bad_message` if the scene has no ball, or the ball cannot start there.
        """
        self._refuse_without_ball("position").throw(throw)
        return self._tick / self.config.rate_hz

    def ball(self) -> BallTruth | None:
        """State of the ball in the world frame; None in a scene without one."""
        return None if self._ball is None else self._ball.state()

    def sights(self) -> list[BallState]:
        """Return the camera's measurements of the ball that arrive at the present tick; call it once a tick."""
        if self._ball is not None and self._camera.sees(self._tick):
            self._camera.see(self._tick, self._ball.state())
        return self._camera.take(self._tick)

    def lead(self, joints: tuple[str, ...], positions: list[float], velocities: list[float]) -> None:
        """Set the newest positions and velocities of another robot's joints, rad and rad/s, which are then not held."""
        begun = self._led.lead(joints, positions, velocities)
        if begun is not None:
            self._torque_limits[np.isin(self._controlled, begun)] = 0.0

    def surroundings(self) -> dict[str, list[float]]:
        """Return the coordinates of the joints that are neither the arm's nor the ball's, by name."""
        return self._surroundings.read(self.scene.data)

    def _pushes(self) -> np.ndarray:
        """Return the generalised forces (J,), N·m, of the active pushes."""
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
            reason="`guide` was requested" if self._guidance else "",
        )

    def _checked_pose(self, positions: list[float]) -> np.ndarray:
        config = self.config
        if len(positions) != config.joint_count:
            sentence = f"positions has {len(positions)} numbers; the arm has {config.joint_count} joints"
            raise bad_message("positions", sentence)
        for joint, (value, (low, high)) in enumerate(zip(positions, config.limits.positions, strict=True)):
            name = config.joint_names[joint]
            if not np.isfinite(value):
                raise bad_message("positions", f"positions: {name} is {value}; it must be finite")
            if not low <= value <= high:
                unit = unit_of("position", config.slides[joint])
                message = (
                    f"positions: {name} at {value:.6g} {unit} lies outside its range {low:.6g} to {high:.6g} {unit}"
                )
                bound = float(low if value < low else high)
                raise Refusal("limit", message, joint=name, quantity="position", value=value, bound=bound)
        return np.array(positions, dtype=float)

    def _check_ball(self, ball: Ball | None) -> None:
        if ball is not None:
            self._refuse_without_ball("ball")
            check_reach(ball=ball.position)
            check_reach(ball=ball.velocity)

    def _refuse_without_ball(self, field: str) -> SimulatedBall:
        """Return the ball. Raises Refusal `bad_message` without one."""
        if self._ball is None:
            cure = 'add a body "ball" with a free joint to its model' if field != "ball" else "leave it null"
            raise bad_message(field, f"{field}: this robot's scene has no ball; {cure}")
        return self._ball
