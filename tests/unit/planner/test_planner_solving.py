"""Plans of the planner's solver, which starts from the rows of the previous plan."""

import msgspec
import numpy as np
import pytest

from deploy.demonstrations.make_forehand import FOREHAND, HIT
from motion.demonstration import Demonstration
from motion.primitive import Primitive, learn
from motion.request import Boundary
from protocol import messages as m
from protocol.errors import Refusal
from robot.description import load_robot
from services.planner.goals import Origin
from services.planner.solving import Made, Solver
from tools.demo.strikes import goal

ROBOT = load_robot()
HOME = Origin(0.0, 0, Boundary(ROBOT.home, np.zeros(6), np.zeros(6)))


@pytest.fixture(scope="module")
def forehand() -> Primitive:
    """The shipped forehand."""
    recorded = np.loadtxt(FOREHAND, delimiter=",", skiprows=1)
    return learn(Demonstration(recorded[:, 0], recorded[:, 1:]))


def solved(solver: Solver, wanted: m.Goal, primitive: Primitive) -> Made:
    """Return the solver's plan for a goal of method "qp"."""
    with pytest.raises(StopIteration) as done:
        next(solver.solve(wanted, primitive, HOME))
    return done.value.value


def code_of(solver: Solver, wanted: m.Goal, primitive: Primitive) -> str:
    """Return the code of the refusal, or "planned"."""
    try:
        solved(solver, wanted, primitive)
    except Refusal as refusal:
        return refusal.code
    return "planned"


def test_a_refusal_does_not_depend_on_previous_goals(forehand: Primitive):
    """For durations around the shortest, each goal after a fastest motion and as the first goal."""
    rng = np.random.default_rng(1)
    for duration in (0.015, 0.022, 0.03, 0.04, 0.1, 0.13, 0.2):
        positions = (HIT + rng.uniform(-0.05, 0.05, 6)).tolist()
        wanted = msgspec.structs.replace(goal(duration=duration), positions=positions)
        after, first = Solver(ROBOT), Solver(ROBOT)
        solved(after, goal(fastest=True), forehand)
        assert code_of(after, wanted, forehand) == code_of(first, wanted, forehand), duration


def test_the_goals_own_end_is_refused_with_the_same_code_with_and_without_alternatives(forehand: Primitive):
    """Even if an alternative exhausts its share of the effort."""
    wanted = goal(duration=0.03)
    others = [m.Alternative(duration=0.02), m.Alternative(positions=[9.0, *HIT[1:]], duration=1.0)]
    with pytest.raises(Refusal) as caught:
        solved(Solver(ROBOT), msgspec.structs.replace(wanted, alternatives=others), forehand)
    assert caught.value.code == code_of(Solver(ROBOT), wanted, forehand) == "infeasible"
    assert caught.value.detail["alternatives"][1] == "limit"


def test_a_late_alternative_does_not_refuse_the_others(forehand: Primitive):
    late, good = m.Alternative(arrival_time=-1.0), m.Alternative(duration=1.2)
    hopeless = msgspec.structs.replace(goal(duration=0.03), alternatives=[late, good])
    assert solved(Solver(ROBOT), hopeless, forehand).alternative == 2
    with pytest.raises(Refusal) as caught:
        solved(Solver(ROBOT), msgspec.structs.replace(hopeless, alternatives=[late, late]), forehand)
    assert (caught.value.code, caught.value.detail["alternatives"]) == ("infeasible", ["late", "late"])


def test_short_goals_are_planned_or_refused_as_infeasible(forehand: Primitive):
    """Although the demonstration, at that speed, exceeds its limits everywhere."""
    rng = np.random.default_rng(2)
    for duration in np.linspace(0.03, 0.1, 8):
        wanted = msgspec.structs.replace(goal(duration=float(duration)), checks=m.Checks(collision=False, torque=False))
        wanted.positions, wanted.velocities = (ROBOT.home + rng.uniform(-0.05, 0.05, 6)).tolist(), [0.0] * 6
        try:
            solved(Solver(ROBOT), wanted, forehand)
        except Refusal as refusal:
            assert refusal.code == "infeasible", (duration, refusal)
            wanted.duration = refusal.detail["min_duration"]
            solved(Solver(ROBOT), wanted, forehand)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_fastest_duration_is_within_a_tenth_of_the_minimum(forehand: Primitive, seed: int):
    nearby = (ROBOT.home + np.random.default_rng(seed).uniform(-0.1, 0.1, 6)).tolist()
    wanted = m.Goal(
        primitive="forehand", positions=nearby, fastest=True, checks=m.Checks(collision=False, torque=False)
    )
    found = solved(Solver(ROBOT), wanted, forehand).plan.duration
    less = msgspec.structs.replace(wanted, fastest=False, duration=0.9 * found)
    assert code_of(Solver(ROBOT), less, forehand) in ("infeasible", "solver_failed")


@pytest.mark.parametrize("duration", [0.001, 0.01, 0.02])
def test_a_goal_far_too_short_is_refused_with_a_duration_that_works(forehand: Primitive, duration: float):
    """A search in small steps would exhaust the effort."""
    wanted = m.Goal(primitive="forehand", positions=list(HIT), duration=duration)
    with pytest.raises(Refusal) as caught:
        solved(Solver(ROBOT), wanted, forehand)
    works = caught.value.detail["min_duration"]
    assert (caught.value.code, works) == ("infeasible", pytest.approx(0.1, abs=0.04))
    assert code_of(Solver(ROBOT), msgspec.structs.replace(wanted, duration=works), forehand) == "planned"


@pytest.mark.parametrize(("field", "value"), [("positions", [9.0, *HIT[1:]]), ("velocities", [99.0] + [0.0] * 5)])
def test_a_fastest_goal_outside_the_limits_is_refused_as_limit(forehand: Primitive, field: str, value: list[float]):
    wanted = msgspec.structs.replace(goal(fastest=True), **{field: value})
    assert code_of(Solver(ROBOT), wanted, forehand) == "limit"


@pytest.mark.parametrize(("method", "plan_only", "code"), [("qp", False, "limit"), ("dmp", True, "invalid_goal")])
@pytest.mark.parametrize("field", ["positions", "velocities"])
@pytest.mark.parametrize("size", [1e200, 1e308])
def test_numbers_that_overflow_are_refused(
    forehand: Primitive, method: str, plan_only: bool, code: str, field: str, size: float
):
    """They are finite, but not everything that is computed from them is."""
    wanted = msgspec.structs.replace(goal(), method=method, plan_only=plan_only, **{field: [size] * 6})
    assert code_of(Solver(ROBOT), wanted, forehand) == code
