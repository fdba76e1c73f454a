"""The demo's five strikes and their error bounds at the hit."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from client import GoalFields
from deploy.demonstrations.make_forehand import HIT, HIT_VELOCITIES
from protocol import messages as m

PRIMITIVE = "forehand"
ANOTHER_START = (-0.35, 0.45, 0.95, -0.1, 0.1, 0.0)  # rad
FASTER = tuple(1.15 * velocity for velocity in HIT_VELOCITIES)  # rad/s
TIGHT = m.GoalLimits(
    positions=[(-0.90, 0.60), None, (0.60, 0.97), None, None, None],
    velocities=[6.0, None, None, None, None, None],
    accelerations=[110.0, None, None, None, None, None],
    jerks=[8000.0, None, None, None, None, None],
)
WAYPOINT = m.Waypoint(
    time_from_start=0.35, positions=[-0.60, 0.50, None, None, None, None], velocities=[-3.0] + 5 * [None]
)
NOISE = 0.01  # fraction of the demonstration's largest excursion and speed, as in fig. 5 of the paper
PUSH = (100.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # rad/s², fig. 5
PUSH_FROM, PUSH_FOR = 0.1, 0.2  # s from the start of the motion
EXCURSION, SPEED = 1.22, 4.6  # rad, rad/s: of joint_1 in the demonstration


@dataclass(frozen=True, slots=True)
class Strike:
    """A goal, the arm's initial posture, disturbances, and error bounds at the hit.

    Attributes:
        title: Title in the report.
        fields: The fields of the goal.
        start: Initial joint positions, rad; by default home.
        noise: Standard deviation of the sensor noise, as a fraction of the demonstration's excursion and speed.
        push: Accelerations of a push on the joints, rad/s²; by default none.
        position_bound: Largest position error of the true arm at the hit on any joint, rad.
        velocity_bound: Largest velocity error of the true arm at the hit on any joint, rad/s.
    """

    title: str
    fields: GoalFields
    start: tuple[float, ...] | None = None
    noise: float = 0.0
    push: tuple[float, ...] | None = None
    position_bound: float = 5e-3
    velocity_bound: float = 5e-2

    @property
    def goal(self) -> m.Goal:
        """The goal."""
        return m.Goal(primitive=PRIMITIVE, **self.fields)  # type: ignore[arg-type]


def hit(velocities: tuple[float, ...] = HIT_VELOCITIES, **fields: Any) -> GoalFields:
    """Return the fields of a goal that hits the ball with the forehand."""
    return GoalFields(positions=list(HIT), velocities=list(velocities), **fields)


def goal(velocities: tuple[float, ...] = HIT_VELOCITIES, **fields: Any) -> m.Goal:
    """Return a goal that hits the ball with the forehand."""
    return m.Goal(primitive=PRIMITIVE, **hit(velocities, **fields))  # type: ignore[arg-type]


STRIKES = (
    Strike("as demonstrated", hit()),
    Strike("new start, 0.8 s", hit(FASTER, duration=0.8), ANOTHER_START),
    Strike("and tighter limits", hit(FASTER, duration=0.8, limits=TIGHT), ANOTHER_START),
    Strike("through a waypoint", hit(waypoints=[WAYPOINT])),
    Strike("noise and a push", hit(), None, NOISE, PUSH, 2e-2, 5e-1),
)


def noise_request(strike: Strike) -> m.Disturb:
    """Return the request for a strike's sensor noise."""
    return m.Disturb(kind="sensor_noise", position_std=strike.noise * EXCURSION, velocity_std=strike.noise * SPEED)


def largest(errors: list[float]) -> float:
    """Return the largest error of any joint."""
    return float(np.abs(errors).max())
