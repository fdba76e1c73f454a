"""Learn a primitive from a `learn` request, or from a CSV file that ships with the robot."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from motion.demonstration import Demonstration, SavitzkyGolay, Smoothing
from motion.errors import InvalidMotion
from motion.listing import listed
from motion.primitive import MAX_PHASES, Primitive, learn
from protocol import messages as m
from protocol.codec import bad_message, matrix

AskedSmoothing = Literal["auto", "none"] | m.SavitzkyGolay

MAX_POSITION = 1e4
"""Largest joint position, rad or m; the squares of larger numbers would overflow."""

MAX_ORDER = 10
"""Largest order of the smoothing polynomial; beyond it the fit is ill-conditioned."""


def demonstration_of(request: m.Learn, names: Sequence[str]) -> Demonstration:
    """Return the recording in `request`, with columns in the order of the arm's joint `names`.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    positions = _of_the_arm(_positions(request), request.joint_names, names, "positions")
    if len(positions) > m.MAX_SAMPLES:
        sentence = f"positions has {len(positions)} samples; at most {m.MAX_SAMPLES} are taken, so send every nth"
        raise bad_message("positions", sentence)
    try:
        return Demonstration(*_one_at_a_time(_times(request, len(positions)), positions))
    except InvalidMotion as error:
        raise bad_message(error.field, str(error)) from None


def spread_of(request: m.Learn, names: Sequence[str]) -> np.ndarray | None:
    """Return the spread (J, P) in `request`, rad, one row for each of the arm's joint `names`, or None.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    if request.spread is None:
        return None
    if not 2 <= len(request.spread) <= MAX_PHASES:
        raise bad_message("spread", f"spread has {len(request.spread)} rows; it must have 2 to {MAX_PHASES}")
    rows = _rows(request.spread, "spread")
    if not (rows > 0).all():
        row, joint = np.argwhere(rows <= 0)[0]
        raise bad_message("spread", f"spread[{row}][{joint}] is {rows[row, joint]:g} rad; it must be greater than 0")
    return _of_the_arm(rows, request.joint_names, names, "spread").T


def learn_demonstration(
    demonstration: Demonstration, smoothing: AskedSmoothing, spread: np.ndarray | None = None
) -> Primitive:
    """Return the primitive of a recording, with the requested smoothing, and weighted by the spread (J, P).

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    try:
        return learn(demonstration, _smoothing(smoothing), spread=spread)
    except InvalidMotion as error:
        raise bad_message(error.field, str(error)) from None


def learned_message(name: str, primitive: Primitive, warnings: Sequence[str] = ()) -> m.Learned:
    """Return the reply about a learned primitive."""
    used = primitive.smoothing
    start, goal = (
        m.Point(positions=end.positions.tolist(), velocities=end.velocities.tolist())
        for end in (primitive.start, primitive.goal)
    )
    return m.Learned(
        name=name,
        duration=primitive.duration,
        basis_count=primitive.basis_count,
        fit_rms=primitive.fit_rms.tolist(),
        noise_estimate=primitive.noise_estimate.tolist(),
        smoothing=used and m.SavitzkyGolay(window_s=used.window_s, order=used.order),
        position_rms=primitive.position_rms.tolist(),
        position_max=primitive.position_max.tolist(),
        start=start,
        goal=goal,
        samples=primitive.samples,
        warnings=list(warnings),
    )


def learn_from_csv(path: Path, joint_names: tuple[str, ...]) -> Primitive | None:
    """Return the primitive recorded in `path` (header: time, then joint names), or None for another arm's.

    The joint names of an arm attached to a scene have a prefix, which the header may omit.

    Raises:
        InvalidMotion: the recording is unusable.
    """
    with path.open() as file:
        header = file.readline().strip().split(",")
        if header not in (["time", *joint_names], ["time", *(name.rpartition("/")[2] for name in joint_names)]):
            return None
        table = np.loadtxt(file, delimiter=",", ndmin=2)
    return learn(Demonstration(table[:, 0], table[:, 1:]))


def _smoothing(asked: AskedSmoothing) -> Smoothing:
    if not isinstance(asked, m.SavitzkyGolay):
        return asked
    if asked.order > MAX_ORDER:
        raise bad_message("smoothing.order", f"smoothing.order is {asked.order}; it must lie in 2 to {MAX_ORDER}")
    return SavitzkyGolay(asked.window_s, asked.order)


def _of_the_arm(positions: np.ndarray, given: Sequence[str] | None, names: Sequence[str], field: str) -> np.ndarray:
    """Return the columns in the order of the arm's joints."""
    columns, arm = positions.shape[1], listed(names)
    if given is None:
        if columns != len(names):
            sentence = f"{field} has {columns} columns; the arm has the {len(names)} joints {arm}"
            raise bad_message(field, f"{sentence}: send one column a joint")
        return positions
    if len(given) != columns:
        raise bad_message("joint_names", f"joint_names has {len(given)} names for {columns} columns of {field}")
    if sorted(given) != sorted(names):
        sentence = f"joint_names are {listed(given)}; the arm's are {arm}: send the name on this arm of each column"
        raise bad_message("joint_names", sentence)
    return positions[:, [list(given).index(name) for name in names]]


def _positions(request: m.Learn) -> np.ndarray:
    positions = _matrix(request)
    if not len(positions):
        raise bad_message("positions", "positions has no samples")
    if positions.shape[1] > m.MAX_JOINTS:
        raise bad_message("positions", f"positions have {positions.shape[1]} joints; at most {m.MAX_JOINTS} are taken")
    if np.abs(positions).max(initial=0.0) > MAX_POSITION:
        row, joint = np.argwhere(np.abs(positions) > MAX_POSITION)[0]
        sentence = f"positions[{row}][{joint}] is {positions[row, joint]:.6g}; it must lie within {MAX_POSITION:g} of 0"
        raise bad_message("positions", sentence)
    return positions


def _matrix(request: m.Learn) -> np.ndarray:
    if isinstance(request.positions, bytes):
        joints = request.joint_count
        if joints is None or joints < 1:
            sentence = f"joint_count is {joints}; it must say how many columns the positions in `bin` have"
            raise bad_message("joint_count", sentence.replace("None", "null"))
        return matrix(request.positions, len(request.positions) // (8 * joints), joints, "positions")
    samples = _rows(request.positions, "positions")
    if request.joint_count not in (None, samples.shape[1]):
        sentence = f"joint_count is {request.joint_count}, the samples have {samples.shape[1]} numbers"
        raise bad_message("joint_count", sentence)
    return samples


def _rows(values: list[list[float]], field: str) -> np.ndarray:
    """Return rows of numbers, one a joint, as a matrix."""
    joints = len(values[0]) if values else 0
    if not joints:
        raise bad_message(field, f"{field} has no {'numbers' if values else 'rows'}; send rows of one number a joint")
    for index, row in enumerate(values):
        if len(row) != joints:
            sentence = f"{field}[{index}] has {len(row)} numbers, and {field}[0] has {joints}; send one a joint"
            raise bad_message(field, sentence)
    return np.array(values, dtype=float)


def _times(request: m.Learn, samples: int) -> np.ndarray:
    if (request.rate is None) == (request.times is None):
        raise bad_message("rate", "give either rate (Hz) or times (s), and not both")
    shortest, longest = m.DURATION_RANGE
    if request.rate is not None:
        slowest, fastest = (samples - 1) / longest, (samples - 1) / shortest
        if not slowest <= request.rate <= fastest:
            sentence = (
                f"rate is {request.rate:g} Hz; {samples} samples must take {shortest} s to {longest} s, "
                f"so {slowest:.3g} to {fastest:.3g} Hz"
            )
            raise bad_message("rate", sentence)
        return np.arange(samples) / request.rate
    if request.times is None or len(request.times) != samples:
        raise bad_message("times", f"times has {len(request.times or ())} entries for {samples} samples")
    if not shortest <= request.times[-1] - request.times[0] <= longest:
        sentence = f"times run from {request.times[0]} to {request.times[-1]} s; {shortest} s to {longest} s are taken"
        raise bad_message("times", sentence)
    return np.array(request.times, dtype=float)


def _one_at_a_time(times: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times and positions, with samples of equal times averaged; unchanged if times decrease anywhere."""
    steps = np.diff(times, prepend=-np.inf)
    if (steps > 0).all() or (steps < 0).any():
        return times, positions
    first = np.flatnonzero(steps)
    counts = np.diff(first, append=len(times))
    return times[first], np.add.reduceat(positions, first) / counts[:, None]
