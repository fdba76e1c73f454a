"""Held joints, which are not the arm's: grippers, fingers, a second arm."""

import math
from collections.abc import Mapping

import mujoco
import numpy as np

from motion.listing import listed
from motion.tracking import tracking_acceleration
from motion.trajectory import Samples, Trajectory, quintic
from protocol.codec import bad_message
from protocol.errors import Refusal
from protocol.topics import MAX_ID
from robot.conversions import unit_of
from robot.description import RobotConfig
from robot.joints import model_ranges, torque_limit
from robot.model import is_slide, joint_ids
from services.sim.model import Scene

GAIN = 0.4
"""alpha·tick of the servos, by eq. 11: stiff; stable up to 2."""
SLOWEST_S, SPEED = 0.5, 1.0
"""Duration of a motion to a new value: this time (s), plus its distance at this speed (rad/s or m/s)."""


class HeldJoints:
    """Servos of H joints, which move smoothly from one value to the next.

    Attributes:
        dofs: Addresses (H,) of the joints in MuJoCo's velocities.
        limits: Largest torques (H,), N·m or N.
        targets: Target value of each, rad or m.
    """

    def __init__(self, config: RobotConfig, scene: Scene, held: Mapping[str, float]) -> None:
        """`held`: initial value of each joint, rad or m."""
        self._begin = dict(held)
        ids = joint_ids(scene.model, tuple(held), "held")
        self.dofs = scene.model.jnt_dofadr[ids].astype(np.intp)
        self.limits = np.array([torque_limit(scene.model, joint) for joint in ids])
        self._ranges = model_ranges(scene.model, ids)
        self._units = [unit_of("position", is_slide(scene.model, joint)) for joint in ids]
        self._qpos = scene.model.jnt_qposadr[ids].astype(np.intp)
        self._model, self._data = scene.model, scene.data
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Reset the joints to their initial values, at rest."""
        self.targets = dict(self._begin)
        values = np.array(list(self.targets.values()))[None]
        self._data.qpos[self._qpos] = values[0]
        self._place_followers()
        self._follow(Samples(values, np.zeros_like(values), np.zeros_like(values)))

    def lead(self, targets: Mapping[str, float]) -> float:
        """Start to move the named joints to new values, rad or m; return the duration, s.

        Raises:
            Refusal: `bad_message` for a joint that is not held, `limit` for a value outside its range.
        """
        self._check(targets)
        self.targets |= targets
        values = np.array(list(self.targets.values()))
        samples, now = self._samples, self._index
        begin = samples.positions[now], samples.velocities[now], samples.accelerations[now]
        duration = SLOWEST_S + float(np.abs(values - begin[0]).max(initial=0.0)) / SPEED
        ticks = math.ceil(duration * self._config.rate_hz)
        still, breaks = np.zeros_like(values), np.array([0.0, ticks * self._config.tick])
        motion = Trajectory(breaks, quintic(begin, (values, still, still), breaks[1])[None])
        path = motion.sample(np.arange(ticks + 1) * self._config.tick)
        path.positions[-1], path.velocities[-1], path.accelerations[-1] = values, 0.0, 0.0
        self._follow(path)
        return ticks * self._config.tick

    def accelerations(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the accelerations (H,) of the coming tick, with feedback; one call is one tick."""
        samples, now = self._samples, self._index
        self._index = then = min(now + 1, len(samples) - 1)
        feedforward = (samples.velocities[then] - samples.velocities[now]) * self._config.rate_hz
        reference = samples.positions[now], samples.velocities[now], feedforward
        wanted = tracking_acceleration(GAIN * self._config.rate_hz, reference, *self._measured())
        return feedforward, wanted - feedforward

    def positions(self) -> dict[str, float]:
        """Return the joints' positions, rad or m."""
        return dict(zip(self.targets, self._measured()[0].tolist(), strict=True)) if self.targets else {}

    def _place_followers(self) -> None:
        """Set the joints that the model's equalities couple to held ones, so that they do not jump."""
        model, qpos = self._model, self._data.qpos
        kind = int(mujoco.mjtEq.mjEQ_JOINT)
        for equality in np.flatnonzero((model.eq_type == kind) & (model.eq_obj2id >= 0)):
            follower, leader = model.jnt_qposadr[[model.eq_obj1id[equality], model.eq_obj2id[equality]]]
            constant, slope, *bends = model.eq_data[equality, :5]
            if follower in self._qpos and leader not in self._qpos and slope and not any(bends):
                follower, leader, constant, slope = leader, follower, -constant / slope, 1 / slope
            if leader in self._qpos and follower not in self._qpos:
                change = qpos[leader] - model.qpos0[leader]
                powers = change ** np.arange(5)
                qpos[follower] = model.qpos0[follower] + powers @ [constant, slope, *bends]

    def _measured(self) -> tuple[np.ndarray, np.ndarray]:
        return self._data.qpos[self._qpos], self._data.qvel[self.dofs]

    def _follow(self, samples: Samples) -> None:
        self._samples, self._index = samples, 0

    def _check(self, targets: Mapping[str, float]) -> None:
        ranges = dict(zip(self.targets, zip(self._ranges.tolist(), self._units, strict=True), strict=True))
        for name, value in targets.items():
            if name not in ranges:
                held = listed(list(ranges)) or "none"
                raise bad_message("joints", f"{name[:MAX_ID]!r} is not a held joint; this robot's config has {held}")
            (low, high), unit = ranges[name]
            if not low <= value <= high:
                sentence = f"{name} at {value:.6g} {unit} lies outside its range {low:.6g} to {high:.6g} {unit}"
                bound = low if value < low else high
                raise Refusal("limit", sentence, joint=name, quantity="position", value=value, bound=bound)
