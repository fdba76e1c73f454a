"""A scenario: a fault, bounds on the reaction, and a function that causes the fault and measures the reaction."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from protocol.messages import Clock
from tools.drill.harness.lab import Lab

Value = float | str
Measured = Mapping[str, Value]
Relation = Literal["=", "≤", "≥", "reported"]
Kind = Literal["exact", "short", "full"]
"""exact: on the stepped clock, the same every time; short: a few seconds in real time; full: only in the drill."""


@dataclass(frozen=True, slots=True)
class Bound:
    """What a reaction must keep: `measured relation value`; a reaction that is only reported keeps any.

    Attributes:
        reaction: What is measured, in words; its key among a scenario's measurements.
        relation: Between the measurement and `value`.
        value: The bound.
        unit: Of both.
        timed: CPU steal alone may make a machine miss it.
    """

    reaction: str
    relation: Relation
    value: Value = 0.0
    unit: str = ""
    timed: bool = False

    def holds(self, measured: Value) -> bool:
        """Return whether `measured` keeps the bound; NaN keeps none."""
        if self.relation == "reported":
            return True
        if isinstance(measured, str) or isinstance(self.value, str):
            return self.relation == "=" and measured == self.value
        if math.isnan(measured):
            return False
        kept = {"=": measured == self.value, "≤": measured <= self.value, "≥": measured >= self.value}[self.relation]
        return bool(kept)


def exactly(reaction: str, value: Value, unit: str = "") -> Bound:
    """Return the bound of a reaction that must be `value`."""
    return Bound(reaction, "=", value, unit)


def none(reaction: str) -> Bound:
    """Return the bound of a count that must be 0."""
    return Bound(reaction, "=", 0)


def at_most(reaction: str, value: float, unit: str = "") -> Bound:
    """Return the bound of a reaction that must be at most `value`."""
    return Bound(reaction, "≤", value, unit)


def at_least(reaction: str, value: float, unit: str = "") -> Bound:
    """Return the bound of a reaction that must be at least `value`."""
    return Bound(reaction, "≥", value, unit)


def timed(bound: Bound) -> Bound:
    """Return a bound that CPU steal alone may make a machine miss."""
    return replace(bound, timed=True)


def reported(reaction: str, unit: str = "") -> Bound:
    """Return a reaction without a bound, reported beside the others."""
    return Bound(reaction, "reported", unit=unit)


@dataclass(frozen=True, slots=True)
class Scenario:
    """One row of the drill. `run` causes the fault and measures every reaction that `bounds` name."""

    name: str
    fault: str
    clock: Clock
    bounds: tuple[Bound, ...]
    run: Callable[[Lab], Measured]
    kind: Kind = "exact"


@dataclass(frozen=True, slots=True)
class Reaction:
    """A bound, its measurement (None: not measured), and whether it held."""

    bound: Bound
    measured: Value | None
    held: bool


@dataclass(frozen=True, slots=True)
class ScenarioOutcome:
    """How a scenario went.

    Attributes:
        scenario: The scenario.
        reactions: One for each of its bounds.
        seconds: How long it took.
        error: Why it could not be carried out, empty if it was.
        before: For each earlier attempt: the steal, and what fell short.
    """

    scenario: Scenario
    reactions: tuple[Reaction, ...]
    seconds: float
    error: str = ""
    before: tuple[str, ...] = ()

    @property
    def held(self) -> bool:
        """Whether every bound held."""
        return not self.error and all(reaction.held for reaction in self.reactions)


def judge(scenario: Scenario, measured: Measured, seconds: float, error: str = "") -> ScenarioOutcome:
    """Compare what was measured with the scenario's bounds; a bound without a measurement does not hold."""
    reactions = tuple(
        Reaction(
            bound, measured.get(bound.reaction), bound.reaction in measured and bound.holds(measured[bound.reaction])
        )
        for bound in scenario.bounds
    )
    return ScenarioOutcome(scenario, reactions, seconds, error)
