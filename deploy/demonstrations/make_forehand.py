"""Make forehand.csv: a forehand of the arm in deploy/robots, from rest at home to the hit.

    python -m deploy.demonstrations.make_forehand

Three key poses joined by quintics. Home and hit are the poses of the paper's arm; the backswing goes further than
the paper's, whose third of a radian is too short to gain speed. The demonstration ends at the hit, at full speed.
"""

import csv
import io
import tomllib
from pathlib import Path

import numpy as np
from scipy.interpolate import BPoly

FOREHAND = Path(__file__).with_name("forehand.csv")
ROBOT = Path(__file__).parents[1] / "robots" / "arm.toml"

RATE_HZ = 500
BACKSWING_TIME = 0.5  # s
HIT_TIME = 1.0  # s
BACKSWING = (-1.05, 0.56, 0.95, 0.25, 0.15, -0.30)  # rad
HIT = (0.17, 0.47, 0.86, -0.0822, 0.0, 0.1058)  # rad
HIT_VELOCITIES = (4.6, -0.4, -0.3, -0.8, -0.4, 1.2)  # rad/s: forwards, a little upwards, the wrist snapping through


def forehand(home: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,), s, and positions (n, J), rad: at rest at home, at rest in the backswing, then through the hit."""
    rest = np.zeros(len(home))
    states = [(home, rest, rest), (BACKSWING, rest, rest), (HIT, HIT_VELOCITIES, rest)]
    motion = BPoly.from_derivatives([0.0, BACKSWING_TIME, HIT_TIME], np.array(states))
    times = np.arange(round(HIT_TIME * RATE_HZ) + 1) / RATE_HZ
    return times, motion(times)


def render() -> str:
    """Return the text of forehand.csv."""
    joints = tomllib.loads(ROBOT.read_text())["joints"]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time", *joints["names"]])
    for time, positions in zip(*forehand(joints["home"]), strict=True):
        # Nine decimals: coarser rounding would show in the second derivative. Adding 0.0 turns -0.0 into 0.0.
        writer.writerow([f"{time:.3f}", *(f"{round(float(value), 9) + 0.0:.9f}" for value in positions)])
    return text.getvalue()


if __name__ == "__main__":
    FOREHAND.write_text(render())
