"""An independent check of commands and states against the limits of the robot's description.

It reads every published command and state, and computes jerks as differences of commanded accelerations. It uses no
results of the planner or the controller.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motion.limits import QUANTITIES, Limits
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from robot.description import RobotConfig

LENGTH = 8192
"""Capacity of the queue of each topic, messages."""
RECOIL_S = 0.5
"""Time after a touch in which the ball may push the arm beyond its limits; these states are reported separately."""
ROUNDING = 1e-6
"""Tolerance of commanded values, as a fraction of their limits."""
TRACKING = 0.005
"""Tolerance of measured values, as a fraction of their limits, for the tracking error."""


class LimitUse(NamedTuple):
    """The used fraction of a limit, with joint, quantity and time, s."""

    fraction: float = 0.0
    joint: str = ""
    quantity: str = ""
    time: float = 0.0

    def __str__(self) -> str:
        return f"{self.joint} {self.quantity} {100 * self.fraction:.0f}%" if self.joint else ""


NONE = LimitUse()


@dataclass(frozen=True, slots=True)
class LimitReport:
    """Result of a check.

    Attributes:
        ticks: Number of ticks that were checked.
        unseen: Number of ticks between them whose command or state was not received.
        closest: Largest use of a limit by a command.
        recoil: Largest use of a limit by a measured state within `RECOIL_S` after a touch.
        violations: Number of ticks at which a limit was exceeded.
        worst: Largest of these violations.
    """

    ticks: int = 0
    unseen: int = 0
    closest: LimitUse = NONE
    recoil: LimitUse = NONE
    violations: int = 0
    worst: LimitUse = NONE


class LimitMonitor:
    """Collects all states and commands of a robot. `read` must be called at least once a second."""

    def __init__(self, bus: Bus, config: RobotConfig) -> None:
        self._config = config
        self._sources = [bus.collect(topic, LENGTH) for topic in (topics.COMMAND, topics.STATE)]
        self._bodies: list[list[bytes]] = [[], []]

    def read(self) -> None:
        """Store the messages since the last call."""
        for source, bodies in zip(self._sources, self._bodies, strict=True):
            while (taken := source.take()) is not None:
                bodies.append(taken[0])

    def drop(self) -> None:
        """Discard all messages until now."""
        self.read()
        self._bodies = [[], []]

    def check(self, touches: Sequence[float] = ()) -> LimitReport:
        """Check the messages since the last check or drop. `touches`: times of contacts of racket and ball, s."""
        (commands, states), self._bodies = self._bodies, [[], []]
        return check(
            (decode(body, m.Command) for body in commands),
            (decode(body, m.State) for body in states),
            touches,
            self._config,
        )


def check(
    commands: Iterable[m.Command], states: Iterable[m.State], touches: Sequence[float], config: RobotConfig
) -> LimitReport:
    """Return the use of the robot's limits by commands and states, both in the order of their ticks.

    The iterables are consumed into arrays, because the messages of a long rally would take gigabytes.
    """
    command_rows = ([c.tick, *c.positions, *c.velocities, *(c.feedforward or c.accelerations)] for c in commands)
    ticks, commanded = _table(command_rows, 3, config)
    state_ticks, measured = _table(([s.tick, *_measured(s)] for s in states), 2, config)
    if not len(ticks) or not len(state_ticks):
        return LimitReport()
    jerks = np.diff(commanded[2], axis=0, prepend=commanded[2][:1]) / config.tick
    jerks[np.diff(ticks, prepend=ticks[0]) != 1] = 0.0
    command_use = _fractions(np.concatenate([commanded, jerks[None]]), config.limits)
    state_use = _fractions(measured, config.limits)
    times = state_ticks * config.tick
    recoiling = np.zeros(len(times), dtype=bool)
    for touch in touches:
        recoiling |= (times >= touch) & (times < touch + RECOIL_S)
    names = config.joint_names
    closest = _largest(command_use, ticks * config.tick, names)
    free_use = np.where(recoiling[None, :, None], 0.0, state_use)
    beyond = (command_use > 1 + ROUNDING).any(axis=(0, 2)), (free_use > 1 + TRACKING).any(axis=(0, 2))
    worst = max(closest, _largest(free_use, times, names))
    violations = int(sum(found.sum() for found in beyond))
    return LimitReport(
        ticks=len(ticks),
        unseen=max(_missing(ticks), _missing(state_ticks)),
        closest=closest,
        recoil=_largest(np.where(recoiling[None, :, None], state_use, 0.0), times, names),
        violations=violations,
        worst=worst if violations else NONE,
    )


def _table(rows: Iterable[Sequence[float]], quantities: int, config: RobotConfig) -> tuple[np.ndarray, np.ndarray]:
    """Return the ticks (n,) in the first column of n rows, and the other columns as (quantities, n, J)."""
    joints = config.joint_count
    table = np.fromiter(rows, np.dtype((float, 1 + quantities * joints)))
    return table[:, 0].astype(int), table[:, 1:].reshape(-1, quantities, joints).transpose(1, 0, 2)


def _measured(state: m.State) -> list[float]:
    """Return positions and velocities, the true ones if the robot side reports them."""
    true = state.truth or state
    return [*true.positions, *true.velocities]


def _fractions(values: np.ndarray, limits: Limits) -> np.ndarray:
    """Return the fractions of the limits that values (quantities, n, J) use, in the order of QUANTITIES."""
    bounds = limits.ranges.transpose(1, 2, 0)[: len(values), :, None]
    middle = np.where(np.isfinite(bounds).all(axis=1), bounds.mean(axis=1), 0.0)
    return np.abs(values - middle) / np.where(np.isfinite(bounds[:, 1]), bounds[:, 1] - middle, np.inf)


def _largest(fractions: np.ndarray, times: np.ndarray, names: Sequence[str]) -> LimitUse:
    quantity, row, joint = map(int, np.unravel_index(int(np.argmax(fractions)), fractions.shape))
    fraction = float(fractions[quantity, row, joint])
    return LimitUse(fraction, names[joint], QUANTITIES[quantity], float(times[row])) if fraction else NONE


def _missing(ticks: np.ndarray) -> int:
    return int(np.clip(np.diff(ticks) - 1, 0, None).sum())
