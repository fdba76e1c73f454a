"""Bounds, and the verdict on measurements."""

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
def test_bounds(bound: Bound, good: list[Value], bad: list[Value]):
    """A bound holds for values that keep it, and never for NaN."""
    assert all(bound.holds(value) for value in good)
    assert not any(bound.holds(value) for value in bad)


def scenario(*bounds: Bound) -> Scenario:
    """Return a scenario that causes nothing."""
    return Scenario("nothing", "nothing happens", "stepped", bounds, lambda _: {})


def test_every_bound_needs_its_measurement():
    """Without its measurement a bound has not held, even one that is only reported."""
    row = scenario(none("jumps"), reported("speed"))
    assert evaluate(row, {"jumps": 0, "speed": 3.0}, 1.0).held
    assert not evaluate(row, {"jumps": 1, "speed": 3.0}, 1.0).held
    assert not evaluate(row, {"speed": 3.0}, 1.0).held
    assert not evaluate(row, {"jumps": 0}, 1.0).held


def test_what_broke_off_has_not_held():
    """An error outweighs measurements that all hold."""
    assert not evaluate(scenario(none("jumps")), {"jumps": 0}, 1.0, "the sim did not start").held
