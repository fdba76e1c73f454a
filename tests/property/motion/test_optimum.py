"""Plans compared with the optimum of an independent formulation in seconds, solved by another solver (DAQP)."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from motion.errors import Infeasible, MotionError, SolverFailed
from motion.limits import Limits
from motion.plan import SplinePlan, plan
from motion.primitive import Primitive
from motion.program.problem import PLACE_TIME
from motion.request import MotionRequest
from tests.property.motion.in_seconds import InSeconds
from tests.property.motion.independent import Inconclusive
from tests.property.motion.random_goals import Manner, any_manner, make_primitive, plain_manner, random_request

seeds = st.integers(0, 2**32 - 1)

WORST, MEDIAN = 1.06, 1.01
"""Cost of a plan ÷ that of the optimum: of all goals, and in the median."""

OF_A_REST = 1.3
"""Bound of the imitation error of the rest of a demonstration ÷ that of its own optimum."""

BORDER = 1e-4
"""Part of their ranges by which limits are tightened or widened to make feasibility unambiguous."""


def stiffness(primitive: Primitive, request: MotionRequest) -> float:
    """Return κ/T (1/s): the imitated duration over the place time, per second of the moving part."""
    begin, end = request.imitates
    return (end - begin) * primitive.duration / (request.place_time or PLACE_TIME) / request.moving_duration


def drawn(seed: int) -> tuple[Primitive, MotionRequest, InSeconds]:
    """Return a random goal of one joint; every second one keeps places."""
    rng = np.random.default_rng(seed)
    primitive, manner = make_primitive(rng), plain_manner(rng)
    place_time = rng.uniform(0.1, 1.0) if seed % 2 else None
    request = random_request(rng, primitive, "coast", Manner(manner.duration, manner.rest_fraction, 0.0, place_time))
    whole = primitive.duration / (place_time or PLACE_TIME) / request.moving_duration
    return primitive, request, InSeconds(primitive, request, whole)


def answer(primitive: Primitive, request: MotionRequest) -> SplinePlan | MotionError:
    try:
        return plan(primitive, request, remedy=False)
    except MotionError as refusal:
        return refusal


def test_costs_of_plans_are_those_of_optima() -> None:
    """A plan costs as much as the optimum, or little more.

    The optimum keeps its limits at 4001 instants alone, so no plan can cost less.
    """
    ratios = {}
    for seed in range(100):
        primitive, request, afresh = drawn(seed)
        planned = answer(primitive, request)
        try:
            best = afresh.optimum()
        except Inconclusive:
            continue
        if isinstance(planned, SplinePlan) and best is not None:
            ratios[seed] = afresh.cost(afresh.weights_of(planned)) / afresh.cost(best)
    assert len(ratios) > 80
    assert min(ratios.values()) > 1 - 1e-6
    median, worst = np.median(list(ratios.values())), max(ratios, key=lambda seed: ratios[seed])
    assert median < MEDIAN, f"median {median}, worst {ratios[worst]} of seed {worst}"
    assert ratios[worst] < WORST, f"seed {worst}"


@pytest.mark.parametrize("first", range(0, 120, 40))
def test_verdicts_are_those_of_another_solver(first: int) -> None:
    """A refused request has no motion slightly inside its limits; a planned one has a motion at them.

    A numerical failure is only allowed in between.
    """
    wrong = {}
    for seed in range(first, first + 40):
        rng = np.random.default_rng(seed)
        primitive, manner = make_primitive(rng), replace(any_manner(rng), follow_through=0.0)
        request = random_request(rng, primitive, "coast", manner)
        afresh = InSeconds(primitive, request, stiffness(primitive, request))
        found = answer(primitive, request)
        try:
            if isinstance(found, SplinePlan):
                if afresh.optimum(-BORDER) is None:
                    wrong[seed] = "planned, but there is none"
            elif isinstance(found, Infeasible | SolverFailed) and afresh.optimum(BORDER) is not None:
                wrong[seed] = f"there is one, but: {found}"
            elif isinstance(found, SolverFailed) and afresh.optimum(-BORDER) is None:
                wrong[seed] = f"clearly infeasible, but: {found}"
        except Inconclusive:
            continue
    assert wrong == {}


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_without_limits_the_plan_is_the_optimum_built_afresh(seed: int) -> None:
    primitive, request, afresh = drawn(seed)
    planned = plan(primitive, replace(request, limits=Limits.unlimited(1)))
    t = np.linspace(0, request.moving_duration, 2001)
    expected = afresh.positions(afresh.unlimited, t)
    found = planned.sample(t[:-1]).positions[:, 0]
    assert np.abs(found - expected[:-1]).max() < 1e-7 * np.ptp(expected)
    if not request.rest_fraction:
        assert planned.report.imitation_rms[0] == pytest.approx(afresh.missed(afresh.unlimited), rel=1e-6)
    assert planned.report.active == ()
    assert planned.report.by_limits.max[0] < 1e-14 * np.ptp(expected)


@pytest.mark.parametrize("place_time", [None, 0.3])
def test_the_rest_of_a_demonstration_costs_little_more_than_its_optimum(place_time: float | None) -> None:
    """The loss is bounded at any phase.

    Two approximations cause it: the metric is the nearest of a few, and the limits' hulls are as coarse as for the
    whole motion.
    """
    errors, costs = {}, {}
    for seed in range(40):
        rng = np.random.default_rng(seed)
        primitive = make_primitive(rng)
        manner = Manner(rng.uniform(0.7, 1.3), phase=rng.uniform(0.05, 0.95), place_time=place_time)
        request = random_request(rng, primitive, "coast", manner)
        planned = answer(primitive, request)
        afresh = InSeconds(primitive, request, stiffness(primitive, request))
        try:
            best = afresh.optimum()
        except Inconclusive:
            continue
        if isinstance(planned, SplinePlan) and best is not None:
            weights = afresh.weights_of(planned)
            errors[seed] = afresh.missed(weights) / afresh.missed(best)
            costs[seed] = afresh.cost(weights) / afresh.cost(best)
    assert len(errors) > 20
    assert max(errors.values()) < OF_A_REST
    assert max(costs.values()) < OF_A_REST


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_the_imitation_error_is_that_of_the_curve(seed: int) -> None:
    """The reported error is that of quadrature over the moving and the straight part, for every manner."""
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng)
    request = random_request(rng, primitive, "coast", replace(any_manner(rng), follow_through=0.0))
    planned = answer(primitive, request)
    assume(isinstance(planned, SplinePlan))
    assert isinstance(planned, SplinePlan)
    duration = request.duration
    t = (np.arange(20_000) + 0.5) / 20_000 * duration
    left = 1 - request.phase
    shown = primitive.sample(request.phase + left * t / duration).accelerations
    shown *= (left * primitive.duration / duration) ** 2
    missed = planned.sample(t).accelerations - shown
    assert planned.report.imitation_rms[0] == pytest.approx(np.sqrt(np.mean(missed**2)), rel=1e-5)
