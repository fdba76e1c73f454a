"""Preview the learning of a recording: the fitted spline, and the motion that imitates it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motion.demonstration import Demonstration, Smoothing
from motion.errors import MotionError
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive, learn
from motion.request import Boundary, MotionRequest
from tools.recordings.doctor import Examination, Robot
from tools.recordings.recording import Recording

SAMPLES = 1001


@dataclass(frozen=True, slots=True, eq=False)
class Preview:
    """Curves of J joints.

    Attributes:
        raw: The recording as read, with one column for each joint.
        examination: The doctor's findings and the repaired recording.
        primitive: The primitive that would be learned.
        times: Times (n,) of the curves, s, on the recording's clock.
        fitted: Positions (n, J) of the primitive, rad.
        imitated: Positions (n, J) of the motion from rest at the primitive's start to its end, in its duration and
            inside the arm's limits, rad; None if it cannot be planned.
        refusal: Why it cannot be planned; otherwise empty.
    """

    raw: Recording
    examination: Examination
    primitive: Primitive
    times: np.ndarray
    fitted: np.ndarray
    imitated: np.ndarray | None
    refusal: str


def preview(raw: Recording, examination: Examination, robot: Robot | None, smoothing: Smoothing = "auto") -> Preview:
    """Fit and imitate an examined recording.

    Raises:
        InvalidMotion: the recording cannot be learned.
    """
    recording = examination.recording
    primitive = learn(Demonstration(recording.times, recording.values), smoothing)
    since = np.linspace(0, primitive.duration, SAMPLES)
    imitated, refusal = None, ""
    try:
        imitated = plan(primitive, _default_request(primitive, robot)).sample(since).positions
    except MotionError as error:
        refusal = _with_joint_name(error, recording.columns)
    fitted = primitive.positions(since / primitive.duration)
    return Preview(raw, examination, primitive, recording.times[0] + since, fitted, imitated, refusal)


def _default_request(primitive: Primitive, robot: Robot | None) -> MotionRequest:
    """Return the request of `volley goal NAME` with the arm at rest at the primitive's start."""
    still = np.zeros(primitive.joint_count)
    free = np.full(primitive.joint_count, np.nan)
    start = Boundary(primitive.start.positions, still, free)
    goal = Boundary(primitive.goal.positions, primitive.goal.velocities, free)
    limits = robot.limits if robot else Limits.unlimited(primitive.joint_count)
    return MotionRequest(start, goal, primitive.duration, limits, tail="stop" if robot else "coast")


def _with_joint_name(error: MotionError, joints: Sequence[str]) -> str:
    """Return the sentence of an error, which numbers its joint, with the joint's name."""
    number: int | None = getattr(error, "joint", None)
    return str(error) if number is None or not joints else str(error).replace(f"joint {number}", joints[number], 1)
