"""Throws that reach an arm's striking volume, drawn with a seed from stated distributions.

A throw is computed backwards: the point and velocity of arrival are drawn, and the flight is integrated back in time,
through the assumed bounce and with the drag of the robot's `[ball]`, to the point of the throw.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from robot.court import CourtConfig
from robot.description import RobotConfig
from robot.kinematics import Kinematics
from robot.striking.conversions import ball_of
from robot.striking.flight import GRAVITY, Air, travel

Kind = Literal["bounce", "volley", "any"]
STEP_S = 0.001
"""Time between the examined points of a flight, s."""
STEPS = 8
"""Number of integration steps of a flight."""
POSTURES = 400
"""Number of postures that sample the striking volume."""
FACING = 0.5
"""A posture can strike if the racket's normal, or its opposite, has at least this component towards the court."""
HEIGHTS = (0.4, 1.6)
"""Default heights of the striking volume, m."""
SPEEDS, ANGLES = (3.0, 5.0), (-0.12, 0.12)
"""Horizontal speed on arrival, m/s, and its direction to either side, rad."""
AFTER_BOUNCE_S, BEFORE_BOUNCE_S = (0.25, 0.4), (0.45, 0.75)
"""Flight times from the bounce to the arrival, and from the throw to the bounce, s."""
VOLLEY_S, VOLLEY_SINKS = (0.6, 0.9), (1.0, 3.5)
"""Flight time of a ball that does not bounce, s, and its downward speed on arrival, m/s."""
THROW_HEIGHTS = (0.3, 3.0)
"""Heights of throws, m."""
OVER_NET = 0.1
"""Clearance above the net in addition to the ball's radius, m."""
TRIES = 1000


@dataclass(frozen=True, slots=True)
class Launch:
    """A throw: position (m) and velocity (m/s); point of arrival and time until then."""

    position: tuple[float, float, float]
    velocity: tuple[float, float, float]
    arrival: tuple[float, float, float]
    flight_time: float
    bounces: int


class NoThrow(Exception):
    """No throw reaches the arm; `str()` says why and what would help."""


class Launcher:
    """Draws throws from beyond the net that arrive anywhere in the striking volume.

    The volume consists of the tool's positions at postures drawn uniformly over the joint ranges, if the racket faces
    the court. Every quantity is uniform in the bounds above; the same seed gives the same throws.
    """

    def __init__(
        self, config: RobotConfig, seed: int = 0, kind: Kind = "bounce", heights: tuple[float, float] = HEIGHTS
    ) -> None:
        """Sample the striking volume. heights: m, of its points.

        Raises:
            NoThrow: the robot has no ball, no court with a net, or no posture from which it can strike.
        """
        if config.ball is None or config.court is None or config.court.net is None:
            raise NoThrow(f"{config.name} has no ball, or no court with a net; give it [ball] and [court] with a net")
        self._flight = ball_of(config)
        self._court: CourtConfig = config.court
        self._random = np.random.default_rng(seed)
        self._kind = kind
        net = config.court.net
        kinematics = Kinematics(config)
        base = kinematics.tool_pose(config.home)[0]
        side = np.sign(np.dot(np.subtract(net.top[:2], base[:2]), net.normal)) or 1.0
        self._forwards = np.array([*net.normal, 0.0]) * side
        """Horizontal, from the arm to the net (3,)."""
        self._points = _striking_volume(config, kinematics, self._forwards, heights, self._random)
        if not len(self._points):
            raise NoThrow(
                f"{config.name}: no posture has its racket between {heights[0]:g} and {heights[1]:g} m facing the net"
            )

    def next(self) -> Launch:
        """Draw a throw.

        Raises:
            NoThrow: none of a thousand candidates passes over the net.
        """
        for _ in range(TRIES):
            kind = self._random.choice(["bounce", "volley"]) if self._kind == "any" else self._kind
            launch = self._bouncing() if kind == "bounce" else self._volley()
            if launch is not None:
                return launch
        raise NoThrow(f"none of {TRIES} throws passes the net; lower it, or bring it nearer to the arm")

    def _bouncing(self) -> Launch | None:
        random, court = self._random, self._court
        arrival, horizontal = self._arrival()
        after = random.uniform(*AFTER_BOUNCE_S)
        floor = court.height + self._flight.radius
        rise = (arrival[2] - floor) / after + GRAVITY * after / 2
        velocity = horizontal + np.array([0.0, 0.0, rise - GRAVITY * after])
        path = self._back(arrival, velocity, 2 * after)
        down = np.flatnonzero(path[:, 2] <= floor)
        if not len(down):
            return None
        bounce, leaving = path[down[0], :3], path[down[0], 3:]
        meeting = leaving / [court.friction, court.friction, -court.restitution]
        dwelt = bounce - court.dwell / 2 * (leaving + meeting) * [1, 1, 0]
        before = self._back(dwelt, meeting, random.uniform(*BEFORE_BOUNCE_S))
        time = (down[0] + len(before) - 1) * STEP_S + court.dwell
        return self._launch(before, arrival, time, bounces=1)

    def _volley(self) -> Launch | None:
        arrival, horizontal = self._arrival()
        velocity = horizontal - np.array([0.0, 0.0, self._random.uniform(*VOLLEY_SINKS)])
        path = self._back(arrival, velocity, self._random.uniform(*VOLLEY_S))
        return self._launch(path, arrival, (len(path) - 1) * STEP_S, bounces=0)

    def _arrival(self) -> tuple[np.ndarray, np.ndarray]:
        """Draw a point of the striking volume and a horizontal velocity there, (3,) each."""
        random = self._random
        angle, speed = random.uniform(*ANGLES), random.uniform(*SPEEDS)
        x, y, _ = -speed * self._forwards
        turned = np.array([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), 0.0])
        return self._points[random.integers(len(self._points))], turned

    def _back(self, position: np.ndarray, velocity: np.ndarray, duration: float) -> np.ndarray:
        """Integrate a flight back in time; return positions and velocities (N, 6), the newest first."""
        times = -STEP_S * np.arange(round(duration / STEP_S) + 1)
        positions, velocities = (np.tile(vector, (len(times), 1)) for vector in (position, velocity))
        return np.hstack(travel(self._flight, Air(self._flight.drag), positions, velocities, times, STEPS))

    def _launch(self, path: np.ndarray, arrival: np.ndarray, time: float, bounces: int) -> Launch | None:
        """Return the throw at the end of `path`; None if it passes below the net or starts out of bounds."""
        net = self._court.net
        assert net is not None
        beyond = (path[:, :3] - net.top) @ self._forwards
        crossing = np.flatnonzero(beyond > 0)
        floor = self._court.height + self._flight.radius
        if not len(crossing) or beyond[0] > 0 or path[:, 2].min() < floor - 0.01:
            return None
        x, y = path[crossing[0], :2] - net.top[:2]
        across = abs(self._forwards[0] * y - self._forwards[1] * x)
        over = path[crossing[0], 2] - net.top[2] - self._flight.radius
        if over < OVER_NET or across > net.half_width or not THROW_HEIGHTS[0] <= path[-1, 2] <= THROW_HEIGHTS[1]:
            return None
        position, velocity = tuple(path[-1, :3].tolist()), tuple(path[-1, 3:].tolist())
        return Launch(position, velocity, tuple(arrival.tolist()), float(time), bounces)


def _striking_volume(
    config: RobotConfig,
    kinematics: Kinematics,
    forwards: np.ndarray,
    heights: tuple[float, float],
    random: np.random.Generator,
) -> np.ndarray:
    """Return positions of the tool (N, 3), m, at which the racket can meet a ball."""
    low, high = np.where(np.isfinite(config.limits.positions), config.limits.positions, [-np.pi, np.pi]).T
    points = []
    for posture in random.uniform(low, high, (POSTURES, config.joint_count)):
        place, rotation = kinematics.tool_pose(posture)
        if heights[0] <= place[2] <= heights[1] and abs(rotation[:, 2] @ forwards) >= FACING:
            points.append(place)
    return np.array(points).reshape(-1, 3)
