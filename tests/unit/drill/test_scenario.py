"""Bounds on measurements, and whether a scenario held."""

import math

import pytest

from tools.drill.scenario import Bound, Scenario, Value, at_least, at_most, evaluate, exactly, none, reported


@pytest.mark.parametrize(
    ("bound", "good", "bad"),
    [
        (exactly("ticks", 20), [20, 20.0], [19, 21, math.nan, "20"]),
        (exactly("outcome", "succeeded"), ["succeeded"], ["aborted", "", 0]),
        (none("jumps"), [0, 0.0], [1, -1, math.nan, ""]),
        (at_most("delay", 0.3, "s"), [0.3, 0, -1.0], [0.301, math.nan, math.inf, "soon"]),
        (at_least("ratio", 0.98), [0.98, 1], [0.979, math.nan, "high"]),
    ],
)
def test_a_bound_holds_for_values_within_it(bound: Bound, good: list[Value], bad: list[Value]):
    """It never holds for NaN or for a value of another type."""
    assert all(bound.holds(value) for value in good)
    assert not any(bound.holds(value) for value in bad)


def scenario(*bounds: Bound) -> Scenario:
    """Return a scenario without an effect."""
    return Scenario("nothing", "nothing happens", bounds, lambda _: {})


def test_a_scenario_with_a_missing_measurement_has_not_held():
    """Even if the bound is only reported."""
    row = scenario(none("jumps"), reported("speed"))
    assert evaluate(row, {"jumps": 0, "speed": 3.0}, 1.0).held
    assert not evaluate(row, {"jumps": 1, "speed": 3.0}, 1.0).held
    assert not evaluate(row, {"speed": 3.0}, 1.0).held
    assert not evaluate(row, {"jumps": 0}, 1.0).held


def test_a_scenario_with_an_error_has_not_held():
    """Even if all measurements hold."""
    assert not evaluate(scenario(none("jumps")), {"jumps": 0}, 1.0, "the sim did not start").held
