"""Chooses when, where and how to hit a ball so that it lands at a target, and corrects that choice."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from robot.striking.arm import Arm
from robot.striking.choice import Choice, NoHit, State
from robot.striking.contact import ContactLaw
from robot.striking.flight import Court, above_net, aim
from robot.striking.hits import Hits, Shots, solve
from robot.striking.landing import landing_error
from robot.striking.path import Path
from robot.striking.quintic import quintic_use
from robot.striking.reachability import Reachability

BLOCKED_STEP_S = 0.02
"""Between places of the ball that are compared with the arm's base."""
ALIKE = 0.03, 0.15
"""rad on any joint and m/s of the ball, by which hits may differ of which one is simulated."""
ContactModel = Callable[[Choice], np.ndarray]
"""Simulates a hit: returns by how much (3,), m/s, the outgoing velocity differs from the contact law's."""


@dataclass(frozen=True, slots=True)
class Options:
    """How hits are searched for.

    time_step, flights: candidates, s. soonest: shortest motion, s. seeds: postures for each. farthest: of a seed, m.
    most: candidates that are looked at closely. use: largest part of a limit in the quick estimate; first_use and
    last_use: of what a choice and a correction leave to the planner, after all others. time_shifts, flight_shifts: what
    a correction tries, s. shift_cost: m of landing error that a second of the first is worth. effort_cost: the same of
    all of the limits. rounds: of a simulated contact. settled: s after a bounce, until when young_cost counts, m of
    landing error for a m of the ball's spread; use_cost: the same for all of the limits. keep_off: m; no hit after the
    ball came so near to the arm's base. room: rad to the ends of the joints' ranges that a m of the ball's spread asks
    for; edge_cost: m of landing error for a m of the spread where there is none. elsewhere: s before the touch, until
    when a correction that finds nothing near chooses again.
    """

    time_step: float = 0.025
    flights: tuple[float, ...] = (0.4, 0.5, 0.6, 0.7, 0.8)
    soonest: float = 0.15
    seeds: int = 2
    farthest: float = 0.25
    most: int = 260
    use: float = 0.97
    first_use: float = 1.4
    last_use: float = 2.5
    time_shifts: tuple[float, ...] = (-0.06, -0.03, -0.01, 0.0, 0.01, 0.03, 0.06)
    flight_shifts: tuple[float, ...] = (-0.1, -0.05, 0.0, 0.05, 0.1)
    shift_cost: float = 0.3
    effort_cost: float = 0.06
    rounds: int = 2
    settled: float = 0.3
    young_cost: float = 3.0
    use_cost: float = 1.0
    keep_off: float = 0.25
    room: float = 4.0
    edge_cost: float = 2.0
    elsewhere: float = 0.25


class Chooser:
    """Chooses hits of one arm on one court.

    law: what a hit does; assign what was learned. simulate: a finer model of the contact, None for the law alone.
    """

    def __init__(
        self,
        arm: Arm,
        reachability: Reachability,
        court: Court,
        law: ContactLaw,
        options: Options | None = None,
        simulate: ContactModel | None = None,
    ) -> None:
        self.law = law
        self.simulate = simulate
        self._simulated: tuple[Choice, np.ndarray] | None = None
        self._arm = arm
        self._reachability = reachability
        self._court = court
        self._options = options or Options()
        speeds = arm.limits.velocities
        self._scale = np.where(np.isfinite(speeds), speeds, 1.0)

    def choose(
        self,
        path: Path,
        start: State,
        target: np.ndarray,
        flight_time: float | None = None,
        earliest: float = -np.inf,
        count: int = 8,
    ) -> list[Choice]:
        """Return up to `count` hits of a ball on `path`, the one with the least expected landing error first.

        start: where the arm's motion begins. target: (3,), m, where the ball is to touch the surface. flight_time: s,
        any if None. earliest: s, no hit before.

        Raises:
            NoHit: there is none.
        """
        options = self._options
        first = max(start.time + options.soonest, earliest, float(path.times[0]))
        times = np.arange(first, path.times[-1] - 1e-9, options.time_step)
        flights = options.flights if flight_time is None else (flight_time,)
        times = times[path.bounced(times) % 1 == 0] if len(times) else times
        if not len(times):
            raise NoHit("late", f"the ball is gone before the arm could move for {options.soonest:g} s")
        times = times[times < self._blocked(path)]
        if not len(times):
            raise NoHit("out of reach", "the ball's path meets the arm's base before the arm could move")
        shots = self._shots(path, np.repeat(times, len(flights)), np.tile(flights, len(times)), target)
        return self._best(self._seeded(shots, start), start, target, count, None)

    def correct(self, path: Path, start: State, target: np.ndarray, last: Choice, count: int = 4) -> list[Choice]:
        """Return hits near `last` as `choose` does, for a ball that is known better now; any hit where none is near.

        start: where the corrected motion begins. Hits that a quintic cannot reach inside the limits come last, the
        easiest first: the planner may find a motion. Hand the one that is played to `rehearsed`.

        Raises:
            NoHit: there is none.
        """
        try:
            return self._best(self._near(path, start, target, last), start, target, count, last)
        except NoHit:
            if last.time - start.time < self._options.elsewhere:
                raise
        return self.choose(path, start, target, count=count)

    def _near(self, path: Path, start: State, target: np.ndarray, last: Choice) -> Shots:
        """Return the shots near to the last hit. Raises NoHit where there is none."""
        options = self._options
        times = last.time + np.array(options.time_shifts)
        times = times[(times > start.time) & (times > path.times[0]) & (times < path.times[-1])]
        times = times[path.bounced(times) % 1 == 0] if len(times) else times
        if not len(times):
            raise NoHit("late", "the ball is not where it was expected at any time near to the hit")
        flights = np.maximum(last.flight_time + np.array(options.flight_shifts), 0.1)
        shots = self._shots(path, np.repeat(times, len(flights)), np.tile(flights, len(times)), target)
        seeds = np.broadcast_to(last.positions, (len(shots), len(last.positions)))
        sides = np.full(len(shots), last.side)
        return replace(shots, wanted=shots.wanted - last.beside, sides=sides, seeds=seeds)

    def refined(self, choice: Choice, start: State) -> Choice:
        """Return the choice with the law asked for what the simulated contact turns into the wanted velocity.

        `choose` does this for the first of its hits.
        """
        if self.simulate is None:
            return choice
        nothing = np.zeros((1, 3))
        rows = [[choice.time], [choice.flight_time], [np.inf], choice.ball[None], choice.incoming[None]]
        best = choice
        for _ in range(self._options.rounds):
            beside = self.simulate(best)
            wanted, sides = (choice.outgoing - beside)[None], [choice.side]
            tail = np.zeros((1, 6, 6)), wanted, nothing, sides, best.positions[None]
            asked = Shots(*(np.asarray(value, dtype=float) for value in (*rows, *tail)))
            hits = solve(self._arm, self.law, asked)
            if not len(hits):
                break
            use = float(self._use(hits, asked, start)[0])
            if use > 1:
                break
            best = self._choice(hits, asked, 0, choice.target, choice.error, use, beside)
        return best

    def rehearsed(self, choice: Choice) -> Choice:
        """Return the choice with what the simulated contact says of it, for its next correction and for learning.

        `correct` leaves this to do while the planner plans. Of hits that are alike one is simulated.
        """
        if self.simulate is None:
            return choice
        if self._simulated is None or not _are_alike(choice, self._simulated[0]):
            self._simulated = choice, self.simulate(choice)
        return replace(choice, beside=self._simulated[1])

    def _shots(self, path: Path, times: np.ndarray, flights: np.ndarray, target: np.ndarray) -> Shots:
        """Return all shots to the target that clear the net. Raises NoHit where none does."""
        ball, net = self._arm.ball, self._court.net
        positions, incoming = path.at(times)
        goal = target + np.array([0.0, 0.0, ball.radius])
        # During the contact the ball moves with the mean of both velocities.
        wanted, leaves, arrivals = aim(ball, path.air, positions, goal, flights, incoming, self.law.duration)
        clears = arrivals[:, 2] < 0
        if net is not None:
            clears &= above_net(ball, path.air, net, leaves, wanted, flights) >= self._court.clearance
        if not clears.any():
            raise NoHit("target", "no flight from the ball's path to the target comes down on it and clears the net")
        nothing = np.zeros((len(times), 0))
        covariances = path.covariance(times)
        ages = path.since_bounce(times)
        sides = np.ones(len(times))
        shots = Shots(times, flights, ages, positions, incoming, covariances, wanted, arrivals, sides, nothing)
        return shots.take(np.flatnonzero(clears))

    def _blocked(self, path: Path) -> float:
        """Return when (s) the ball comes near to the arm's base; inf if it does not."""
        times = np.arange(path.times[0], path.times[-1], BLOCKED_STEP_S)
        places, _ = path.at(times)
        away = np.linalg.norm(places[:, None] - self._arm.fixed, axis=2).min(axis=1, initial=np.inf)
        near = np.flatnonzero(away < self._options.keep_off)
        return float(times[near[0]]) if len(near) else np.inf

    def _seeded(self, shots: Shots, start: State) -> Shots:
        """Return the shots with postures to search from, those nearest to one of the table. Raises NoHit."""
        arm, options = self._arm, self._options
        sides = (1, -1) if arm.racket.two_sided else (1,)
        change = shots.wanted - shots.incoming
        normals = change / np.linalg.norm(change, axis=1, keepdims=True)
        places = np.tile(shots.positions - arm.offset * normals, (len(sides), 1))
        signs = np.repeat(sides, len(shots))
        faces = signs[:, None] * np.tile(normals, (len(sides), 1))
        seeds, away = self._reachability.seeds(places, faces, start.positions, self._scale, options.seeds)
        order = np.argsort(away, axis=None, kind="stable")[: options.most]
        order = order[away.ravel()[order] < options.farthest]
        if not len(order):
            raise NoHit("out of reach", f"the racket comes nowhere within {away.min():.2f} m of the ball's path")
        rows = order // away.shape[1]
        picked = shots.take(rows % len(shots))
        return replace(picked, sides=signs[rows], seeds=seeds.reshape(-1, seeds.shape[2])[order])

    def _best(self, shots: Shots, start: State, target: np.ndarray, count: int, last: Choice | None) -> list[Choice]:
        options = self._options
        hits = solve(self._arm, self.law, shots, None if last is None else last.mobility)
        if not len(hits):
            raise NoHit("out of reach", "no posture has the racket where the ball comes by, turned to the target")
        use = self._use(hits, shots, start)
        most = options.first_use if last is None else options.last_use
        if use.min() > most:
            raise NoHit("limits", f"the easiest hit needs {use.min():.2f} of the arm's limits")
        error = landing_error(self.law, self._arm, hits, shots)
        if last is None:
            cost = error + self._doubt(hits, shots, use)
        else:
            cost = error + options.shift_cost * np.abs(shots.times[hits.shots] - last.time) + options.effort_cost * use
        hard = use > options.use
        order = np.lexsort([np.where(hard, use, cost), hard])[:count]
        order = order[use[order] <= most]
        beside = np.zeros(3) if last is None else last.beside
        choices = [
            self._choice(hits, shots, int(row), target, float(error[row]), float(use[row]), beside) for row in order
        ]
        if last is None:
            choices[0] = self.refined(choices[0], start)
        return choices

    def _doubt(self, hits: Hits, shots: Shots, use: np.ndarray) -> np.ndarray:
        """Return what it costs (n,), m, that a hit will be corrected.

        For early hits, for those that leave little of the limits, and for those near to the end of a joint's range; in
        proportion to how uncertain the ball's place is then.
        """
        options = self._options
        spread = np.sqrt(np.trace(shots.covariances[hits.shots, :3, :3], axis1=1, axis2=2))
        young = np.clip(1 - shots.ages[hits.shots] / options.settled, 0, 1)
        low, high = self._arm.limits.positions.T
        room = np.minimum(hits.postures - low, high - hits.postures).min(axis=1)
        edge = np.clip(1 - room / (options.room * spread), 0, 1)
        return spread * (options.young_cost * young + options.use_cost * use + options.edge_cost * edge)

    def _use(self, hits: Hits, shots: Shots, start: State) -> np.ndarray:
        begin = start.positions, start.velocities, start.accelerations
        durations = shots.times[hits.shots] + self.law.duration / 2 - start.time
        return quintic_use(self._arm.limits, begin, hits.postures, hits.speeds, durations)

    def _choice(
        self, hits: Hits, shots: Shots, row: int, target: np.ndarray, error: float, use: float, beside: np.ndarray
    ) -> Choice:
        shot = int(hits.shots[row])
        time = float(shots.times[shot])
        return Choice(
            time,
            time + self.law.duration / 2,
            hits.postures[row],
            hits.speeds[row],
            float(shots.flights[shot]),
            np.asarray(target, dtype=float),
            shots.positions[shot],
            shots.incoming[shot],
            shots.wanted[shot] + beside,
            beside,
            hits.places[row],
            hits.normals[row],
            hits.velocities[row],
            int(shots.sides[shot]),
            hits.mobility[row],
            error,
            use,
        )


def _are_alike(choice: Choice, other: Choice) -> bool:
    """Return whether two hits are so near to each other that a contact does the same."""
    turned = np.abs(choice.positions - other.positions).max()
    faster = np.abs(np.stack([choice.incoming - other.incoming, choice.outgoing - other.outgoing])).max()
    return bool(turned < ALIKE[0] and faster < ALIKE[1] and choice.side == other.side)
