"""Demonstrations for the arm: a quintic, or a strike recorded by a person on such an arm."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.table_tennis.scene import BALL, FIRST_S, GEARS, RACKET, court
from motion.demonstration import Demonstration
from motion.primitive import Primitive, learn
from robot.description import RobotConfig
from robot.striking.arm import Arm
from robot.striking.calibration import calibrate
from robot.striking.choice import State
from robot.striking.chooser import Chooser
from robot.striking.contact import ContactLaw
from robot.striking.estimator import Estimator, NoiseModel
from robot.striking.options import Options
from robot.striking.reachability import Reachability
from robot.striking.simulated_contact import SimulatedContact

STILL_S = 0.7


def learned(path: Path) -> Primitive:
    """Return the strike in a CSV file: a line of names, then time (s) and seven positions (rad).

    Raises:
        ValueError: the file cannot be read, or is not a recording of seven joints; the sentence says why.
    """
    try:
        table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: {error}; give a CSV file with a line of names, then numbers") from error
    if table.shape[1] != len(GEARS) + 1:
        raise ValueError(
            f"{path}: has {table.shape[1]} columns; it needs {len(GEARS) + 1}, time and {len(GEARS)} joints"
        )
    return learn(Demonstration(table[:, 0] - table[0, 0], table[:, 1:]))


def still(home: np.ndarray) -> Primitive:
    """Return a demonstration that stays at `home` (7,): its imitation has the least acceleration."""
    return learn(Demonstration(np.linspace(0.0, STILL_S, 100), np.tile(home, (100, 1))))


def quintic_of(config: RobotConfig, folder: Path) -> Primitive:
    """Return `quintic` of an arm; its table of postures is stored in `folder`."""
    arm, table = Arm(config, RACKET, BALL), Reachability.of(config, folder)
    contact = SimulatedContact(config, "target_ball")
    return quintic(arm, table, calibrate(arm, table, contact).law, config.home)


def quintic(arm: Arm, table: Reachability, law: ContactLaw, home: np.ndarray) -> Primitive:
    """Return a quintic from rest at `home` (7,) to the hit of a central ball."""
    estimator = Estimator(BALL, court(), NoiseModel(1e-6, restitution_std=1e-4))
    for time in (0.0, 0.008):
        flown = np.array([2.5, 0.0, 0.5]) * time - [0, 0, 9.81 * time * (time + BALL.step) / 2]
        estimator.observe(time, np.array([-0.6, 0.0, 1.85]) + flown)
    start = State(FIRST_S, home, 0 * home, 0 * home)
    chooser = Chooser(arm, table, court(), law, replace(Options(), use=2.0))
    choice = next(chooser.choose(estimator.path(1.5), start, np.array([-0.6, 0.0, 0.77])))
    times = np.linspace(0, choice.goal_time - FIRST_S, 200)
    s = (times / times[-1])[:, None]
    way, arrival = choice.positions - home, choice.velocities * times[-1]
    positions = home + s**3 * (way * (10 - 15 * s + 6 * s**2) + arrival * (-4 + 7 * s - 3 * s**2))
    return learn(Demonstration(times, positions))
