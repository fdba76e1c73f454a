"""The place term of the cost, weighted by the spread of several recordings."""

from dataclasses import replace

import numpy as np
import pytest

from motion.alternatives import End, plan_best
from motion.demonstration import Demonstration
from motion.errors import InvalidMotion
from motion.limits import Limits
from motion.plan import Plan, plan
from motion.primitive import Primitive, learn
from motion.program.imitation import place_weights
from motion.program.problem import PLACE_TIME
from motion.request import Boundary, MotionRequest, Waypoint

DURATION = 4.0
TIMES = np.linspace(0, DURATION, 401)
S = TIMES / DURATION
SHOWN = np.stack([0.6 * np.sin(4 * S), 0.5 * S**2], axis=1)
AGREED = (S > 0.4) & (S < 0.6)
FREE = np.full(2, np.nan)

NARROW = np.where(np.abs(np.linspace(0, 1, 101) - 0.5) < 0.15, 0.002, 0.06)
"""Spread of recordings that agree around the middle of the phase, rad."""


@pytest.fixture(scope="module")
def plain() -> Primitive:
    return learn(Demonstration(TIMES, SHOWN))


def spread_by(primitive: Primitive, *columns: np.ndarray) -> Primitive:
    return replace(primitive, spread=np.stack(columns))


def distances(primitive: Primitive, limits: Limits | None = None, **more: object) -> np.ndarray:
    """Return the distance (n, 2), rad, between the plan of `planned_aside` and the demonstration."""
    return np.abs(planned_aside(primitive, limits, **more).sample(TIMES).positions - primitive.positions(S))


def planned_aside(primitive: Primitive, limits: Limits | None = None, **more: object) -> Plan:
    """Plan a motion of 4 s whose start and goal are 0.2 rad from the demonstration's."""
    start = Boundary(primitive.start.positions + 0.2, primitive.start.velocities, FREE)
    goal = Boundary(primitive.goal.positions + 0.2, primitive.goal.velocities, FREE)
    request = MotionRequest(start, goal, DURATION, limits or Limits.unlimited(2), tail="coast", **more)  # type: ignore[arg-type]
    return plan(primitive, request)


def test_a_plan_is_near_the_demonstration_where_recordings_agree(plain: Primitive) -> None:
    """The second joint has an even spread, so its plan is the one without weights."""
    primitive = spread_by(plain, NARROW, np.full(101, 0.03))
    weighted, even = distances(primitive), distances(plain, place_time=PLACE_TIME)
    assert weighted[AGREED, 0].max() < 0.25 * even[AGREED, 0].max()
    assert weighted[AGREED, 0].max() < 0.003
    outside = (S > 0.05) & (S < 0.25)
    assert weighted[outside, 0].mean() > 1.08 * even[outside, 0].mean()
    assert np.abs(weighted[:, 1] - even[:, 1]).max() < 1e-9


def test_a_plan_is_the_optimum_of_the_weighted_cost(plain: Primitive) -> None:
    """The derivative of the cost along variations that keep the ends is zero; integrals by the trapezoidal rule."""
    primitive = spread_by(plain, NARROW, NARROW[::-1] + 0.01)
    fine = np.linspace(0, 1, 20_001)
    weights = np.stack(
        [np.interp(fine, np.linspace(0, 1, 51), row) for row in place_weights(primitive, 0.0, 1.0)], axis=1
    )
    stiffness = DURATION / PLACE_TIME

    def slope(planned: Plan, bump: np.ndarray, bent: np.ndarray) -> np.ndarray:
        """Return half the derivative of the cost along a variation `bump` with second derivative `bent`, (2,)."""
        samples, shown = planned.sample(DURATION * fine), primitive.sample(fine)
        apart = samples.positions - shown.positions, DURATION**2 * (samples.accelerations - shown.accelerations)
        integrand = apart[1] * bent[:, None] + stiffness**4 * weights * apart[0] * bump[:, None]
        return np.asarray(np.trapezoid(integrand, fine, axis=0))

    planned = planned_aside(primitive)
    size = stiffness**4 * (weights * (planned.sample(DURATION * fine).positions - primitive.positions(fine)) ** 2)
    for power in (3, 4, 6):
        bump = (fine * (1 - fine)) ** power
        bent = np.gradient(np.gradient(bump, fine), fine)
        scale = np.sqrt(np.trapezoid(size + 1e-12, fine, axis=0) * np.trapezoid(bent**2, fine))
        assert (np.abs(slope(planned, bump, bent)) < 0.01 * scale).all()
        plain_slope = slope(planned_aside(plain, place_time=PLACE_TIME), bump, bent)
        assert (np.abs(plain_slope) > 0.05 * scale).all()


def test_an_even_spread_is_equivalent_to_a_place_time(plain: Primitive) -> None:
    even = spread_by(plain, np.full(30, 0.02), np.full(30, 0.05))
    middle = (Waypoint(2.0, SHOWN[200] + [0.05, np.nan], FREE),)
    limits = Limits(np.array([[-1.0, 1.0]] * 2), np.array([0.72, 0.4]), np.full(2, 20.0), np.full(2, np.inf))
    for limited in (None, limits):
        one = planned_aside(even, limited, waypoints=middle).sample(TIMES).positions
        other = planned_aside(plain, limited, waypoints=middle, place_time=PLACE_TIME).sample(TIMES).positions
        assert np.abs(one - other).max() < 1e-6


def test_limits_hold_with_weights_and_change_the_plan_where_recordings_disagree(plain: Primitive) -> None:
    primitive = spread_by(plain, NARROW, NARROW)
    limits = Limits(np.array([[-1.0, 1.0]] * 2), np.array([0.605, 1.0]), np.full(2, 3.0), np.full(2, 60.0))
    weighted, even = distances(primitive, limits), distances(plain, limits, place_time=PLACE_TIME)
    samples = planned_aside(primitive, limits).sample(np.linspace(0, DURATION, 40_001))
    assert (np.abs(samples.velocities) <= limits.velocities).all()
    assert (np.abs(samples.accelerations) <= limits.accelerations).all()
    assert weighted[AGREED, 0].max() < 0.5 * even[AGREED, 0].max()


def test_the_rest_of_a_movement_has_the_weights_of_its_phases(plain: Primitive) -> None:
    primitive = spread_by(plain, NARROW, NARROW)
    rest = np.array(place_weights(primitive, 0.5, 1.0)[0])
    assert rest[0] > 100 * rest[-1]
    s = 0.3
    state = primitive.sample(np.array([s]))
    start = Boundary(state.positions[0] + 0.03, state.velocities[0], FREE)
    goal = Boundary(primitive.goal.positions, primitive.goal.velocities, FREE)
    left = (1 - s) * DURATION
    request = MotionRequest(start, goal, left, Limits.unlimited(2), tail="coast", phase=s)
    at = np.linspace(0.5, 0.6, 20)
    apart = np.abs(plan(primitive, request).sample((at - s) * DURATION).positions - primitive.positions(at))
    assert apart.max() < 0.002
    further = Boundary(goal.positions + 1, goal.velocities, FREE)
    index, _ = plan_best(primitive, request, [End(goal, left), End(further, left)])
    assert index == 0


@pytest.mark.parametrize("spread", [np.ones((1, 5)), np.ones((2, 1)), np.ones((2, 1002)), np.ones(5), np.zeros((2, 5))])
def test_a_malformed_spread_is_refused(spread: np.ndarray) -> None:
    with pytest.raises(InvalidMotion) as refusal:
        learn(Demonstration(TIMES, SHOWN), spread=spread)
    assert refusal.value.field == "spread"
