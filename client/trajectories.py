"""Convert planned trajectories to arrays, and to the form that the controller accepts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgspec.structs import replace

from protocol import messages as m
from protocol.codec import matrix

if TYPE_CHECKING:
    import numpy as np

ROUNDING = 1e-6
"""Tolerance for the rounding of a duration, ticks."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """A sampled motion: N samples of J joints.

    Attributes:
        times: (N,), s on the robot's clock.
        positions: (N, J), rad.
        velocities: (N, J), rad/s.
        accelerations: (N, J), rad/s².
        hit_index: Index of the sample at the goal; later samples are the stop.
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    hit_index: int


def samples(motion: m.GoalReply | m.Trajectory | m.Plan) -> Samples:
    """Return the samples of a planned or published motion as arrays.

    Args:
        motion: The reply of `plan` with `include_trajectory`, a trajectory, or a publication of `topics.PLAN`.

    Raises:
        ValueError: the reply has no trajectory.
        Refusal: `bad_message`, if the trajectory has no samples but only `pieces`.
    """
    import numpy as np

    if isinstance(motion, m.GoalReply):
        motion = _included(motion)
    shape = motion.count, len(motion.joint_names)
    names = "positions", "velocities", "accelerations"
    columns = {name: matrix(getattr(motion, name), *shape, name) for name in names}
    times = motion.start_time + motion.dt * np.arange(motion.count)
    return Samples(times=times, hit_index=motion.hit_index, **columns)


def executable(reply: m.GoalReply, rate_hz: float) -> m.Trajectory:
    """Return the trajectory of a plan in the form that `execute` accepts: as polynomial pieces, if it has them.

    Args:
        reply: The planner's reply to a goal with `include_trajectory`.
        rate_hz: Ticks a second, from `description`.

    Raises:
        ValueError: the reply has no trajectory.
    """
    trajectory = _included(reply)
    if not trajectory.pieces:
        return trajectory
    return replace(
        trajectory,
        positions=None,
        velocities=None,
        accelerations=None,
        dt=1.0 / rate_hz,
        count=math.ceil(trajectory.pieces.breaks[-1] * rate_hz - ROUNDING) + 1,
        hit_index=round(reply.duration * rate_hz),
    )


def _included(reply: m.GoalReply) -> m.Trajectory:
    """Return the trajectory of a reply. Raises ValueError if it has none."""
    if reply.trajectory is None:
        raise ValueError("the plan has no trajectory; ask for it with include_trajectory=True")
    return reply.trajectory
