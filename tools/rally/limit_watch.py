"""What the arm was commanded and what it did, tick by tick, against the limits of its description.

Nothing of the planner's or the controller's is used: every published command and state is read, and jerks are
differences of commanded accelerations.
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
"""Messages that may wait to be read, of each topic."""
RECOIL_S = 0.5
"""For so long after a touch the arm may be thrown beyond its limits by the ball; what it did then is counted apart."""
ROUNDING = 1e-6
"""A commanded value may pass its limit by this part of it."""
TRACKING = 0.005
"""The same of a measured one: the arm follows its reference that closely."""


class Share(NamedTuple):
    """The part of a limit that was used, whose limit it is, and when (s)."""

    share: float = 0.0
    joint: str = ""
    quantity: str = ""
    time: float = 0.0

    def __str__(self) -> str:
        return f"{self.joint} {self.quantity} {100 * self.share:.0f}%" if self.joint else ""


NONE = Share()


@dataclass(frozen=True, slots=True)
class Findings:
    """What a check found.

    ticks, unseen: that were checked, and those between them whose command or state was not received. closest: limit
    of a command. recoil: of a measured state soon after a touch. violations: ticks at which a limit was passed, and the
    worst of them.
    """

    ticks: int = 0
    unseen: int = 0
    closest: Share = NONE
    recoil: Share = NONE
    violations: int = 0
    worst: Share = NONE


class LimitWatch:
    """Collects every state and command of a robot. Call `read` at least once a second, `check` when there is time."""

    def __init__(self, bus: Bus, config: RobotConfig) -> None:
        self._config = config
        self._sources = [bus.collect(topic, LENGTH) for topic in (topics.COMMAND, topics.STATE)]
        self._bodies: list[list[bytes]] = [[], []]

    def read(self) -> None:
        """Take what was published since the last call."""
        for source, bodies in zip(self._sources, self._bodies, strict=True):
            while (taken := source.take()) is not None:
                bodies.append(taken[0])

    def drop(self) -> None:
        """Forget what was published until now."""
        self.read()
        self._bodies = [[], []]

    def check(self, touches: Sequence[float] = ()) -> Findings:
        """Check what was read since the last check or drop. touches: times (s) at which the racket met the ball."""
        (commanded, did), self._bodies = self._bodies, [[], []]
        commands = (decode(body, m.Command) for body in commanded)
        return check(commands, (decode(body, m.State) for body in did), touches, self._config)


def check(
    commands: Iterable[m.Command], states: Iterable[m.State], touches: Sequence[float], config: RobotConfig
) -> Findings:
    """Return what commands and states, in the order of their ticks, used of the robot's limits.

    It keeps their numbers alone: the messages of a long rally would take gigabytes.
    """
    asked_rows = ([c.tick, *c.positions, *c.velocities, *(c.feedforward or c.accelerations)] for c in commands)
    ticks, commanded = _table(asked_rows, 3, config)
    seen, did = _table(([s.tick, *_measured(s)] for s in states), 2, config)
    if not len(ticks) or not len(seen):
        return Findings()
    jerks = np.diff(commanded[2], axis=0, prepend=commanded[2][:1]) / config.tick
    jerks[np.diff(ticks, prepend=ticks[0]) != 1] = 0.0
    asked = _shares(np.concatenate([commanded, jerks[None]]), config.limits)
    measured = _shares(did, config.limits)
    times = seen * config.tick
    thrown = np.zeros(len(times), dtype=bool)
    for touch in touches:
        thrown |= (times >= touch) & (times < touch + RECOIL_S)
    names, at = config.joint_names, ticks * config.tick
    closest = _largest(asked, at, names)
    free = np.where(thrown[None, :, None], 0.0, measured)
    passed = (asked > 1 + ROUNDING).any(axis=(0, 2)), (free > 1 + TRACKING).any(axis=(0, 2))
    worst = max(closest, _largest(free, times, names))
    wrong = int(sum(found.sum() for found in passed))
    return Findings(
        ticks=len(ticks),
        unseen=max(_gaps(ticks), _gaps(seen)),
        closest=closest,
        recoil=_largest(np.where(thrown[None, :, None], measured, 0.0), times, names),
        violations=wrong,
        worst=worst if wrong else NONE,
    )


def _table(rows: Iterable[Sequence[float]], quantities: int, config: RobotConfig) -> tuple[np.ndarray, np.ndarray]:
    """Return the ticks (n,) that rows begin with, and what follows in them, (quantities, n, J)."""
    joints = config.joint_count
    table = np.fromiter(rows, np.dtype((float, 1 + quantities * joints)))
    return table[:, 0].astype(int), table[:, 1:].reshape(-1, quantities, joints).transpose(1, 0, 2)


def _measured(state: m.State) -> list[float]:
    """Return positions and velocities, the true ones where the robot side says them."""
    true = state.truth or state
    return [*true.positions, *true.velocities]


def _shares(values: np.ndarray, limits: Limits) -> np.ndarray:
    """Return the part of each limit that values (quantities, n, J), in the order of QUANTITIES, use: 1 is at it."""
    bounds = limits.ranges.transpose(1, 2, 0)[: len(values), :, None]
    middle = np.where(np.isfinite(bounds).all(axis=1), bounds.mean(axis=1), 0.0)
    return np.abs(values - middle) / np.where(np.isfinite(bounds[:, 1]), bounds[:, 1] - middle, np.inf)


def _largest(shares: np.ndarray, times: np.ndarray, names: Sequence[str]) -> Share:
    quantity, row, joint = map(int, np.unravel_index(int(np.argmax(shares)), shares.shape))
    share = float(shares[quantity, row, joint])
    return Share(share, names[joint], QUANTITIES[quantity], float(times[row])) if share else NONE


def _gaps(ticks: np.ndarray) -> int:
    return int(np.clip(np.diff(ticks) - 1, 0, None).sum())
