"""What a scenario is: a fault, bounds on the reaction, and a function that causes the one and measures the other."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from protocol.messages import Clock
from tools.drill.harness.lab import Lab

Value = float | str
Measured = Mapping[str, Value]
Relation = Literal["=", "≤", "≥", "told"]
Kind = Literal["exact", "short", "full"]
"""exact: on the stepped clock, the same every time; short: in real time, for seconds; full: in the drill alone."""


@dataclass(frozen=True, slots=True)
class Bound:
    """What a reaction has to keep: `measured relation value`; what is only told has no value to keep.

    `reaction` says in words what is measured, and names it among a scenario's measurements. `timed`: a machine whose
    host withholds a core may miss it for that alone.
    """

    reaction: str
    relation: Relation
    value: Value = 0.0
    unit: str = ""
    timed: bool = False

    def holds(self, measured: Value) -> bool:
        """Return whether `measured` keeps the bound; what is not a number keeps none."""
        if self.relation == "told":
            return True
        if isinstance(measured, str) or isinstance(self.value, str):
            return self.relation == "=" and measured == self.value
        if math.isnan(measured):
            return False
        kept = {"=": measured == self.value, "≤": measured <= self.value, "≥": measured >= self.value}[self.relation]
        return bool(kept)


def exactly(reaction: str, value: Value, unit: str = "") -> Bound:
    """Return the bound of a reaction that has to be `value`."""
    return Bound(reaction, "=", value, unit)


def none(reaction: str) -> Bound:
    """Return the bound of a count that has to be 0."""
    return Bound(reaction, "=", 0)


def at_most(reaction: str, value: float, unit: str = "") -> Bound:
    """Return the bound of a reaction that may not exceed `value`."""
    return Bound(reaction, "≤", value, unit)


def at_least(reaction: str, value: float, unit: str = "") -> Bound:
    """Return the bound of a reaction that may not stay below `value`."""
    return Bound(reaction, "≥", value, unit)


def timed(bound: Bound) -> Bound:
    """Return a bound that a machine whose host withholds a core may miss for that alone."""
    return replace(bound, timed=True)


def told(reaction: str, unit: str = "") -> Bound:
    """Return a reaction that is reported beside the others, without a bound."""
    return Bound(reaction, "told", unit=unit)


@dataclass(frozen=True, slots=True)
class Scenario:
    """One row of the drill. `run` measures every reaction that `bounds` name."""

    name: str
    fault: str
    clock: Clock
    bounds: tuple[Bound, ...]
    run: Callable[[Lab], Measured]
    kind: Kind = "exact"


@dataclass(frozen=True, slots=True)
class Reaction:
    """A bound, what was measured beside it (None: nothing), and whether it held."""

    bound: Bound
    measured: Value | None
    held: bool


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a scenario went; `broken` says why it could not be carried through, if it could not.

    `before`: of each try before, what the host of the machine had done and what fell short.
    """

    scenario: Scenario
    reactions: tuple[Reaction, ...]
    seconds: float
    broken: str = ""
    before: tuple[str, ...] = ()

    @property
    def held(self) -> bool:
        """Whether every bound held."""
        return not self.broken and all(reaction.held for reaction in self.reactions)


def judge(scenario: Scenario, measured: Measured, seconds: float, broken: str = "") -> Outcome:
    """Hold what was measured against the scenario's bounds; a bound without a measurement does not hold."""
    reactions = tuple(
        Reaction(
            bound, measured.get(bound.reaction), bound.reaction in measured and bound.holds(measured[bound.reaction])
        )
        for bound in scenario.bounds
    )
    return Outcome(scenario, reactions, seconds, broken)
