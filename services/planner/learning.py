"""From a `learn` request, or a CSV file that ships with the robot, to a primitive."""

from pathlib import Path

import numpy as np

from motion.demonstration import Demonstration, SavitzkyGolay, Smoothing
from motion.errors import InvalidMotion
from motion.primitive import Primitive, learn
from protocol import messages as m
from protocol.codec import bad_message, matrix


def learn_from_request(request: m.Learn) -> Primitive:
    """Return the primitive that `request` demonstrates.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    positions = _positions(request)
    times = _times(request, len(positions))
    smoothing: Smoothing
    if isinstance(request.smoothing, m.SavitzkyGolay):
        smoothing = SavitzkyGolay(request.smoothing.window_s, request.smoothing.order)
    else:
        smoothing = request.smoothing
    try:
        return learn(Demonstration(times, positions), smoothing)
    except InvalidMotion as error:
        raise bad_message(error.field, str(error)) from None


def learned_message(name: str, primitive: Primitive) -> m.Learned:
    """Return what the planner says of a primitive it learned."""
    used = primitive.smoothing
    return m.Learned(
        name=name,
        duration=primitive.duration,
        basis_count=primitive.basis_count,
        fit_rms=primitive.fit_rms.tolist(),
        noise_estimate=primitive.noise_estimate.tolist(),
        smoothing=used and m.SavitzkyGolay(window_s=used.window_s, order=used.order),
    )


def learn_from_csv(path: Path, joint_names: tuple[str, ...]) -> Primitive | None:
    """Return the primitive recorded in `path` (header: time, then joint names), or None for another arm's.

    Raises:
        InvalidMotion: the recording is unusable.
    """
    with path.open() as file:
        header = file.readline().strip().split(",")
        if header != ["time", *joint_names]:
            return None
        table = np.loadtxt(file, delimiter=",", ndmin=2)
    return learn(Demonstration(table[:, 0], table[:, 1:]))


def _positions(request: m.Learn) -> np.ndarray:
    if isinstance(request.positions, bytes):
        joints = request.joint_count
        if joints is None or joints < 1:
            raise bad_message("joint_count", "joint_count must say how many columns the positions in `bin` have")
        return matrix(request.positions, len(request.positions) // (8 * joints), joints, "positions")
    lengths = {len(row) for row in request.positions}
    if len(lengths) != 1 or lengths == {0}:
        raise bad_message(
            "positions", f"positions must be samples of one length, one number a joint; here {sorted(lengths)}"
        )
    if request.joint_count not in (None, *lengths):
        raise bad_message(
            "joint_count", f"joint_count is {request.joint_count}, the samples have {lengths.pop()} numbers"
        )
    return np.array(request.positions, dtype=float)


def _times(request: m.Learn, samples: int) -> np.ndarray:
    if (request.rate is None) == (request.times is None):
        raise bad_message("rate", "give either rate (Hz) or times (s), and not both")
    if request.times is not None:
        if len(request.times) != samples:
            raise bad_message("times", f"times has {len(request.times)} entries for {samples} samples")
        return np.array(request.times, dtype=float)
    if not request.rate or request.rate <= 0:
        raise bad_message("rate", f"rate is {request.rate} Hz; it must be greater than 0")
    return np.arange(samples) / request.rate
