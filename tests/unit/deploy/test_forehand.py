"""The forehand that ships: made by its script, inside the arm's limits, and ending where the ball stands."""

import csv

import numpy as np
import pytest

from deploy.demonstrations.make_forehand import FOREHAND, HIT_TIME, render
from robot.description import load_robot
from robot.kinematics import Kinematics

ROBOT = load_robot()
GAP = 0.002
"""Largest distance of ball and strings at the hit, m."""


def read() -> tuple[list[str], np.ndarray, np.ndarray]:
    with FOREHAND.open(newline="") as file:
        header, *rows = csv.reader(file)
    table = np.array(rows, dtype=float)
    return header, table[:, 0], table[:, 1:]


def test_the_script_makes_the_file():
    made = np.loadtxt(render().splitlines()[1:], delimiter=",")
    kept = np.loadtxt(FOREHAND, delimiter=",", skiprows=1)
    # The last decimal may differ between mathematics libraries.
    np.testing.assert_allclose(kept, made, rtol=0, atol=1.1e-9)
    assert FOREHAND.read_text().splitlines()[0] == render().splitlines()[0]


def test_it_runs_from_rest_at_home_at_500_hz():
    header, times, positions = read()
    assert header == ["time", *ROBOT.joint_names]
    np.testing.assert_allclose(times, np.arange(501) / 500)
    np.testing.assert_allclose(positions[0], ROBOT.home)
    assert np.abs(positions[1] - positions[0]).max() < 1e-6


@pytest.mark.parametrize("duration", [1.0, 0.8])
def test_it_leaves_room_in_every_limit(duration: float):
    """At least a third of each range is left for other starts, waypoints, and the stop after the hit."""
    _, times, positions = read()
    step = times[1] * duration / HIT_TIME
    middle = ROBOT.limits.positions.mean(axis=1)
    half_range = np.diff(ROBOT.limits.positions, axis=1)[:, 0] / 2
    assert (np.abs(positions - middle) < 2 / 3 * half_range).all()
    assert (np.abs(np.diff(positions, axis=0)) / step < 2 / 3 * ROBOT.limits.velocities).all()
    assert (np.abs(np.diff(positions, 2, axis=0)) / step**2 < 2 / 3 * ROBOT.limits.accelerations).all()
    assert (np.abs(np.diff(positions, 3, axis=0)) / step**3 < 2 / 3 * ROBOT.limits.jerks).all()


def test_it_ends_before_the_ball_at_speed():
    _, times, positions = read()
    kinematics = Kinematics(ROBOT)
    model = kinematics.model
    velocities = np.diff(positions[-2:], axis=0)[0] / times[1]
    centre, rotation = kinematics.tool_pose(positions[-1])
    normal = rotation[:, 2]
    reach = model.geom("ball").size[0] + model.geom("string_bed").size[1] + GAP
    np.testing.assert_allclose(model.body("ball").pos, centre + reach * normal, atol=1e-4)
    np.testing.assert_allclose(model.body("tee").pos, model.body("ball").pos - [0, 0, model.geom("ball").size[0]])
    racket = kinematics.tool_velocity(positions[-1], velocities)
    assert 4 < racket @ normal < 6
    assert np.linalg.norm(racket - (racket @ normal) * normal) < 0.15 * np.linalg.norm(racket), "straight through"
