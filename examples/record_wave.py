"""Write an artificial recording, a wave around the arm's home, for an arm that has no recording yet.

    python examples/record_wave.py [ROBOT.toml [FILE.csv]]

The file has a header, then one row for each sample: time in s, then the joints in rad. `volley learn` reads recordings
of your own in the same form.
"""

import sys
from pathlib import Path

import numpy as np

from robot.description import load_robot
from robot.shipped import DEFAULT_ROBOT_CONFIG

DURATION_S = 2.0
RATE_HZ = 200
REACH = 0.3
"""rad from home, at most."""


def wave(home: np.ndarray, ranges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times (n,), s, and positions (n, J), rad: each joint swings towards the middle of its range (J, 2).

    The arm begins at rest at home, and ends at rest at half of its largest deflection.
    """
    times = np.arange(round(DURATION_S * RATE_HZ) + 1) / RATE_HZ
    middle = np.clip(np.zeros_like(home), *ranges.T) if not np.isfinite(ranges).all() else ranges.mean(axis=1)
    swing = np.clip(middle - home, -REACH, REACH)
    swing = np.where(np.abs(swing) < REACH / 3, REACH / 3, swing)
    s = times / DURATION_S
    ease = s**3 * (10 - 15 * s + 6 * s**2)  # minimum jerk, from 0 to 1
    return times, home + np.outer(ease * (0.5 + np.sin(np.pi * s) ** 2), swing)


def main(robot: str | Path = DEFAULT_ROBOT_CONFIG, file: str | Path = "wave.csv") -> None:
    """Write the file."""
    config = load_robot(robot)
    times, positions = wave(config.home, config.limits.positions)
    header = ",".join(("time", *config.joint_names))
    np.savetxt(file, np.column_stack((times, positions)), fmt="%.6f", delimiter=",", header=header, comments="")
    print(f"wrote {file}: {len(times)} samples of {config.joint_count} joints, {times[-1]:g} s")


if __name__ == "__main__":
    main(*sys.argv[1:])
