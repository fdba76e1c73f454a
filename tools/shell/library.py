"""`volley learn`, `primitives` and `forget`: the library of primitives."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from tyro.conf import arg

from protocol import messages as m
from tools.shell.flags import Name, Number, Seconds, Source, Switch
from tools.shell.shell import Shared, UsageError, reach


def primitives(*, shell: Shared) -> None:
    """List the library."""
    with reach(shell) as link:
        link.print(m.Primitives(primitives=link.arm.primitives()))


def forget(name: Name, *, shell: Shared) -> None:
    """Remove a primitive from the library.

    Args:
        name: Of the primitive.
    """
    with reach(shell) as link:
        link.print(link.arm.forget(name))


def learn(
    name: Name,
    file: Source,
    *,
    rate: Number = None,
    duration: Seconds = None,
    smoothing: Literal["auto", "none"] = "auto",
    window: Seconds = None,
    order: Annotated[int, arg(metavar="N")] = 5,
    replace: Switch = False,
    shell: Shared,
) -> None:
    """Learn a primitive from a demonstration: one row a sample, the first column time (s), then the joints (rad).

    Prints how far the learned movement is from its samples, where it begins and ends, and warnings about the recording.

    Args:
        name: Of the new primitive.
        file: A .csv file, with or without a header, or a .npy file.
        rate: Samples per second; all columns are then joints.
        duration: Stretch the times to last this long, s; for recordings against a phase from 0 to 1.
        smoothing: auto fits a penalised spline, each joint smoothed as its noise asks for; none follows every sample.
        window: Smooth with a Savitzky-Golay filter this long, s, instead, as the paper does.
        order: Of that filter's polynomial.
        replace: Overwrite a primitive of this name.
        shell: How to reach the robot.
    """
    positions, times = split(read_samples(file), file, rate, duration)
    filtered = m.SavitzkyGolay(window_s=window, order=order) if window is not None else smoothing
    with reach(shell) as link:
        link.print(link.arm.learn(name, positions, rate=rate, times=times, smoothing=filtered, replace=replace))


def read_samples(file: Path) -> np.ndarray:
    """Return the table of numbers in a .csv or .npy file, samples × columns.

    Raises:
        UsageError: it cannot be read, or is no such table.
    """
    try:
        if file.suffix == ".npy":
            values = np.load(file)
        else:
            lines = [line for line in file.read_text().splitlines() if line.strip() and not line.startswith("#")]
            rows = [line.replace(";", ",").replace("\t", ",").split(",") for line in lines]
            values = np.array(rows[1:] if rows and _is_header(rows[0]) else rows, float)
    except (OSError, ValueError) as error:
        raise UsageError(f"{file} cannot be read: {error}") from None
    if values.ndim != 2 or values.dtype.kind not in "fiu" or not values.size:
        raise UsageError(
            f"{file} has the shape {values.shape} of {values.dtype}; it must be samples × columns of numbers"
        )
    return values.astype(float)


def split(
    samples: np.ndarray, file: Path, rate: float | None, duration: float | None
) -> tuple[np.ndarray, list[float] | None]:
    """Return positions and times (None where `rate` says them) from a table of samples.

    Raises:
        UsageError: there is no column of joints, or rate and duration contradict each other.
    """
    if rate is not None:
        if duration is not None:
            raise UsageError("--rate and --duration say the same thing twice; give one of them")
        return samples, None
    if samples.shape[1] < 2:
        raise UsageError(f"{file} has one column; give time and at least one joint, or --rate")
    times = samples[:, 0]
    if duration is not None:
        length = times[-1] - times[0]
        if not length > 0.0:
            raise UsageError(f"{file}: the first column does not rise, so that it is no time; give --rate")
        times = (times - times[0]) * (duration / length)
    return samples[:, 1:], times.tolist()


def _is_header(row: list[str]) -> bool:
    try:
        float(row[0])
    except ValueError:
        return True
    return False
