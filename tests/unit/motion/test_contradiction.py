"""Mean derivatives of the prescribed values against the limits."""

from dataclasses import replace

import numpy as np
import pytest

from motion import plan as planning
from motion.errors import Infeasible
from motion.limits import Limits
from motion.plan import plan
from motion.primitive import Primitive
from motion.program import constraint_generation
from motion.program.contradiction import InfeasibleRows, check_means
from motion.program.equalities import fixed_values
from motion.request import Boundary, MotionRequest, Waypoint
from tests.unit.motion.asking import Ask


def limits_of(velocity: float = np.inf, acceleration: float = np.inf, jerk: float = np.inf) -> Limits:
    """Limits of one joint."""
    return Limits(np.array([[-np.inf, np.inf]]), *(np.array([x]) for x in (velocity, acceleration, jerk)))


def check(request: MotionRequest, limits: Limits) -> InfeasibleRows | None:
    """Return the contradiction of a request with limits."""
    try:
        check_means(fixed_values(request), request.moving_duration, limits)
    except InfeasibleRows as found:
        return found
    return None


def waypoint(time: float, position: float, velocity: float = np.nan) -> Waypoint:
    """A waypoint of one joint."""
    return Waypoint(time, np.array([position]), np.array([velocity]))


@pytest.mark.parametrize(
    ("request_", "kind", "bound", "quantity", "s"),
    [
        # 1 rad in 0.5 s: mean velocity 2.
        ({"start": (0.0, 0.0), "goal": (1.0, 3.0)}, "velocity", 2.0, 1, 0.5),
        # From 3 rad/s, 2 rad/s less in the mean: mean acceleration, weighted towards the begin, 2·(2 − 3)/0.5.
        ({"start": (0.0, 3.0), "goal": (1.0, 1.0)}, "acceleration", 4.0, 2, 0.5),
        ({"start": (0.0, 2.5), "goal": (1.0, 4.0)}, "acceleration", 8.0, 2, 0.5),
        # From rest to rest the acceleration changes from 2·2/0.5 to −2·2/0.5: mean jerk 3·16/0.5.
        ({"start": (0.0, 0.0), "goal": (1.0, 0.0)}, "jerk", 96.0, 3, 0.5),
        # … and from acceleration 0, 3·8/0.5; with a given final acceleration of 10, 3·(10 − 2·(9 − 2)/0.5)/0.5.
        ({"start": (0.0, 0.0, 0.0), "goal": (1.0, 3.0)}, "jerk", 48.0, 3, 0.5),
        ({"start": (0.0, 2.0), "goal": (1.0, 9.0, 10.0)}, "jerk", 168.0, 3, 0.5),
        # Over two intervals of 0.25 s: velocities −4 and 8, so 2·12/0.5.
        ({"goal": (1.0, 8.0), "waypoints": (waypoint(0.25, -1.0),)}, "acceleration", 48.0, 2, 0.5),
        # A waypoint's velocity counts like an end's.
        ({"goal": (1.0, 8.0), "waypoints": (waypoint(0.25, -1.0, 9.0),)}, "acceleration", 104.0, 2, 0.25),
    ],
)
def test_a_mean_beyond_its_limit_is_a_contradiction(
    ask: Ask, request_: dict[str, object], kind: str, bound: float, quantity: int, s: float
) -> None:
    request = ask(**{"start": (0.0, -4.0), "duration": 0.5} | request_)
    assert check(request, limits_of(**{kind: bound})) is None
    found = check(request, limits_of(**{kind: bound * (1 - 1e-5)}))
    assert found is not None
    assert (found.joint, found.quantity, found.s) == (0, quantity, s)


def test_the_jerk_over_three_intervals(ask: Ask) -> None:
    """From positions alone: mean accelerations −8 and 8 over two intervals each, so 3·16/1.5."""
    through = waypoint(0.5, 1.0), waypoint(1.0, 0.0)
    request = ask(start=(0.0, 6.0), goal=(1.0, 6.0), duration=1.5, waypoints=through)
    assert check(request, limits_of(jerk=32.0)) is None
    found = check(request, limits_of(jerk=31.999))
    assert found is not None
    assert (found.quantity, found.s) == (3, 0.5)


def test_every_motion_keeps_its_own_means() -> None:
    """Limits at the extremes of a smooth curve never contradict values taken from it."""
    rng = np.random.default_rng(4)
    t = np.linspace(0, 1, 4001)
    for _ in range(200):
        p = np.polynomial.Polynomial(rng.normal(size=8))
        v, a, j = p.deriv(), p.deriv(2), p.deriv(3)
        extremes = [np.abs(each(t)).max() * (1 + 1e-6) for each in (v, a, j)]
        start, goal = (Boundary(*(np.array([each(at)]) for each in (p, v, a))) for at in (0.0, 1.0))
        times = np.sort(rng.choice(np.arange(2, 99), 5, replace=False)) / 100
        given = rng.random(5) < 0.5
        waypoints = tuple(waypoint(at, p(at), v(at) if know else np.nan) for at, know in zip(times, given, strict=True))
        request = MotionRequest(start, goal, 1.0, limits_of(*extremes), waypoints)
        assert check(request, request.limits) is None


def test_a_free_waypoint_and_free_limits_contradict_nothing(ask: Ask) -> None:
    request = ask(duration=1e-3, waypoints=(waypoint(5e-4, np.nan, 0.0),))
    assert check(request, Limits.unlimited(1)) is None
    assert check(request, limits_of(jerk=1e12)) is None


def test_the_joint_that_exceeds_its_limit_most_is_named() -> None:
    rest, free = np.zeros(3), np.full(3, np.nan)
    limits = Limits(np.tile([-9.0, 9.0], (3, 1)), np.array([1.0, 1.0, 4.0]), np.full(3, 1e6), np.full(3, 1e9))
    goal = Boundary(np.array([0.2, 1.5, 5.0]), rest, free)
    found = check(MotionRequest(Boundary(rest, rest, rest), goal, 1.0, limits), limits)
    assert found is not None
    assert (found.joint, found.quantity) == (1, 1)


def test_a_contradiction_is_refused_without_a_program(
    figure: Primitive, ask: Ask, paper_limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(constraint_generation, "least_distance", None)
    with pytest.raises(
        Infeasible, match=r"the velocity limit of [0-9.]+ rad/s cannot be kept near 0.010 s; allow more time, loosen"
    ):
        plan(figure, ask(start=(0.0, 0.0), duration=0.02, limits=paper_limits), remedy=False)


def test_the_shortest_duration_is_planned_where_imitating_takes_too_long(
    figure: Primitive, ask: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    request = ask(start=(0.0, 0.0), limits=limits_of(4.0, 30.0, 500.0))
    imitating = planning.plan_fastest(figure, request)
    monkeypatch.setattr(planning, "FASTEST_PRECISIONS", ((planning.USUAL, 0.0), planning.FASTEST_PRECISIONS[1]))
    other = planning.plan_fastest(figure, request)
    assert other.duration == imitating.duration > planning.MIN_IMITATED * figure.duration
    assert other.report.certified
    assert (other.report.imitation_rms > imitating.report.imitation_rms).all()


def test_the_shortest_duration_is_found_to_a_hundredth(figure: Primitive, ask: Ask, paper_limits: Limits) -> None:
    """In 2 % less the goal is refused."""
    request = ask(start=(0.0, 0.0, 0.0), limits=paper_limits)
    found = planning.plan_fastest(figure, request).duration
    with pytest.raises(Infeasible):
        plan(figure, replace(request, duration=round(0.98 * found, 3)), remedy=False)
