"""The fast estimate of a hit's use of the limits, compared with the planner's stop."""

import numpy as np

from motion.braking import fastest_stop
from motion.demonstration import Demonstration
from motion.errors import CannotStop
from motion.plan import plan
from motion.primitive import learn
from motion.request import Boundary, MotionRequest
from robot.description import load_robot
from robot.striking.quintic import quintic_use, stopping_distance

ROBOT = load_robot()
LIMITS, HOME = ROBOT.limits, ROBOT.home
STILL = np.zeros(ROBOT.joint_count)
FOLLOW_THROUGH_S = 0.018


def test_the_stopping_distance_agrees_with_the_planners_stop():
    speeds = np.random.default_rng(0).uniform(0, 1, (200, ROBOT.joint_count)) ** 3 * LIMITS.velocities
    stop = fastest_stop(speeds, np.zeros_like(speeds), LIMITS.accelerations, LIMITS.jerks)
    _, highest, _, _ = stop.extremes(np.zeros_like(speeds))
    np.testing.assert_allclose(stopping_distance(LIMITS, speeds), highest, rtol=1e-9, atol=1e-12)


def test_hits_after_which_the_arm_cannot_stop_are_those_that_the_planner_refuses():
    velocities = np.zeros((1, ROBOT.joint_count))
    velocities[0, 0] = 0.5 * LIMITS.velocities[0]
    way = stopping_distance(LIMITS, velocities)[0, 0]
    room = way + FOLLOW_THROUGH_S * velocities[0, 0]
    demonstration = Demonstration(np.linspace(0, 1, 50), np.linspace(0, 1, 50)[:, None] * (0.1 + 0 * HOME) + HOME)
    for beside, stops in ((1e-3, True), (-1e-3, False)):
        postures = HOME[None].copy()
        postures[0, 0] = LIMITS.positions[0, 1] - room - beside
        durations = np.array([1.5])
        use = quintic_use(LIMITS, (HOME, STILL, STILL), postures, velocities, durations, FOLLOW_THROUGH_S)[0]
        assert np.isfinite(use) == stops
        start, goal = Boundary(HOME, STILL, STILL), Boundary(postures[0], velocities[0], np.full_like(STILL, np.nan))
        request = MotionRequest(start, goal, 1.5, LIMITS, follow_through=FOLLOW_THROUGH_S)
        try:
            plan(learn(demonstration), request, ROBOT.tick, remedy=False)
            planned = True
        except CannotStop:
            planned = False
        assert planned == stops
