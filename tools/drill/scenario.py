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
"""exact: on the stepped clock, repeatable; short: a few seconds in real time; full: run by the drill only."""


@dataclass(frozen=True, slots=True)
class Bound:
    """A bound on a measurement, `measurement relation value`; `reported` means that there is no bound.

    Attributes:
        reaction: Name of the measured quantity; the key of a scenario's measurement.
        relation: Relation between the measurement and `value`.
        value: Value of the bound.
        unit: Unit of the measurement and `value`.
        timed: Whether CPU steal can make the bound fail.
    """

    reaction: str
    relation: Relation
    value: Value = 0.0
    unit: str = ""
    timed: bool = False

    def holds(self, measured: Value) -> bool:
        """Return whether `measured` satisfies the bound; NaN satisfies only `reported`."""
        if self.relation == "reported":
            return True
        if isinstance(measured, str) or isinstance(self.value, str):
            return self.relation == "=" and measured == self.value
        if math.isnan(measured):
            return False
        held = {"=": measured == self.value, "≤": measured <= self.value, "≥": measured >= self.value}[self.relation]
        return bool(held)


def exactly(reaction: str, value: Value, unit: str = "") -> Bound:
    """Return the bound of a measurement that must equal `value`."""
    return Bound(reaction, "=", value, unit)


def none(reaction: str) -> Bound:
    """Return the bound of a count that must be 0."""
    return Bound(reaction, "=", 0)


def at_most(reaction: str, value: float, unit: str = "") -> Bound:
    """Return the bound of a measurement that must be at most `value`."""
    return Bound(reaction, "≤", value, unit)


def at_least(reaction: str, value: float, unit: str = "") -> Bound:
    """Return the bound of a measurement that must be at least `value`."""
    return Bound(reaction, "≥", value, unit)


def timed(bound: Bound) -> Bound:
    """Mark a bound as one that CPU steal can make fail."""
    return replace(bound, timed=True)


def reported(reaction: str, unit: str = "") -> Bound:
    """Return the entry of a measurement that is reported and has no bound."""
    return Bound(reaction, "reported", unit=unit)


@dataclass(frozen=True, slots=True)
class Scenario:
    """One row of the drill. `run` causes the fault and returns the measurements that `bounds` name."""

    name: str
    fault: str
    bounds: tuple[Bound, ...]
    run: Callable[[Lab], Measured]
    clock: Clock = "stepped"
    kind: Kind = "exact"


@dataclass(frozen=True, slots=True)
class Reaction:
    """A bound, its measurement (None: not measured), and whether the bound held."""

    bound: Bound
    measured: Value | None
    held: bool


@dataclass(frozen=True, slots=True)
class ScenarioOutcome:
    """The outcome of a scenario.

    Attributes:
        scenario: The scenario.
        reactions: One for each of its bounds.
        seconds: Duration, s.
        error: The error that ended the scenario; empty without one.
        earlier_attempts: For each earlier attempt, its steal time and failures.
    """

    scenario: Scenario
    reactions: tuple[Reaction, ...]
    seconds: float
    error: str = ""
    earlier_attempts: tuple[str, ...] = ()

    @property
    def held(self) -> bool:
        """Whether every bound held."""
        return not self.error and all(reaction.held for reaction in self.reactions)


def evaluate(scenario: Scenario, measured: Measured, seconds: float, error: str = "") -> ScenarioOutcome:
    """Compare measurements with the scenario's bounds; a bound without a measurement does not hold."""
    reactions = tuple(
        Reaction(
            bound, measured.get(bound.reaction), bound.reaction in measured and bound.holds(measured[bound.reaction])
        )
        for bound in scenario.bounds
    )
    return ScenarioOutcome(scenario, reactions, seconds, error)
