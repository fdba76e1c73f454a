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

ContactModel = Callable[[Choice], np.ndarray]
"""Simulates a hit: returns by how much (3,), m/s, the outgoing velocity differs from the contact law's."""


@dataclass(frozen=True, slots=True)
class Options:
    """How hits are searched for.

    time_step, flights: candidates, s. soonest: shortest motion, s. seeds: postures for each. farthest: of a seed, m.
    most: candidates that are looked at closely. use: largest part of a limit in the quick estimate. time_shifts,
    flight_shifts: what a correction tries, s; shift_cost: m of landing error that a second of the first is worth.
    rounds: of a simulated contact.
    """

    time_step: float = 0.025
    flights: tuple[float, ...] = (0.4, 0.5, 0.6, 0.7, 0.8)
    soonest: float = 0.15
    seeds: int = 2
    farthest: float = 0.25
    most: int = 260
    use: float = 0.97
    time_shifts: tuple[float, ...] = (-0.06, -0.03, -0.01, 0.0, 0.01, 0.03, 0.06)
    flight_shifts: tuple[float, ...] = (-0.1, -0.05, 0.0, 0.05, 0.1)
    shift_cost: float = 0.1
    rounds: int = 2


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
        shots = self._shots(path, np.repeat(times, len(flights)), np.tile(flights, len(times)), target)
        return self._best(self._seeded(shots, start), start, target, path, count, None)

    def correct(self, path: Path, start: State, target: np.ndarray, last: Choice) -> Choice:
        """Return the hit near `last` with the least expected landing error, for a ball that is known better now.

        start: where the corrected motion begins.

        Raises:
            NoHit: there is none.
        """
        options = self._options
        times = last.time + np.array(options.time_shifts)
        times = times[(times > start.time) & (times > path.times[0]) & (times < path.times[-1])]
        times = times[path.bounced(times) % 1 == 0] if len(times) else times
        if not len(times):
            raise NoHit("late", "the ball is not where it was expected at any time near to the hit")
        flights = np.maximum(last.flight_time + np.array(options.flight_shifts), 0.1)
        shots = self._shots(path, np.repeat(times, len(flights)), np.tile(flights, len(times)), target)
        seeds = np.broadcast_to(last.positions, (len(shots), len(last.positions)))
        shots = replace(shots, sides=np.full(len(shots), last.side), seeds=seeds)
        return self._best(shots, start, target, path, 1, last)[0]

    def _shots(self, path: Path, times: np.ndarray, flights: np.ndarray, target: np.ndarray) -> Shots:
        """Return all shots to the target that clear the net. Raises NoHit where none does."""
        ball, net = self._arm.ball, self._court.net
        positions, incoming = path.at(times)
        goal = target + [0.0, 0.0, ball.radius]
        wanted, arrivals = aim(ball, path.air, positions, goal, flights)
        # During the contact the ball moves with the mean of both velocities.
        leaves = positions + (incoming - wanted) * self.law.duration / 2
        wanted, arrivals = aim(ball, path.air, leaves, goal, flights)
        clears = arrivals[:, 2] < 0
        if net is not None:
            clears &= above_net(ball, path.air, net, positions, wanted, flights) >= self._court.clearance
        if not clears.any():
            raise NoHit("target", "no flight from the ball's path to the target comes down on it and clears the net")
        nothing = np.zeros((len(times), 0))
        covariances = path.covariance(times)
        shots = Shots(times, flights, positions, incoming, covariances, wanted, arrivals, np.ones(len(times)), nothing)
        return shots.take(np.flatnonzero(clears))

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

    def _best(
        self, shots: Shots, start: State, target: np.ndarray, path: Path, count: int, last: Choice | None
    ) -> list[Choice]:
        hits = solve(self._arm, self.law, shots)
        if not len(hits):
            raise NoHit("out of reach", "no posture has the racket where the ball comes by, turned to the target")
        use = self._use(hits, shots, start)
        good = np.flatnonzero(use <= self._options.use)
        if not len(good):
            raise NoHit("limits", f"the easiest hit needs {use.min():.2f} of the arm's limits")
        hits, use = hits.take(good), use[good]
        error = landing_error(self.law, self._arm, hits, shots)
        cost = error
        if last is not None:
            cost = error + self._options.shift_cost * np.abs(shots.times[hits.shots] - last.time)
        order = np.argsort(cost, kind="stable")[:count]
        choices = [self._choice(hits, shots, int(row), target, float(error[row]), float(use[row])) for row in order]
        if self.simulate is not None:
            choices[0] = self._refined(choices[0], shots, int(hits.shots[order[0]]), start)
        return choices

    def _use(self, hits: Hits, shots: Shots, start: State) -> np.ndarray:
        begin = start.positions, start.velocities, start.accelerations
        durations = shots.times[hits.shots] + self.law.duration / 2 - start.time
        return quintic_use(self._arm.limits, begin, hits.postures, hits.speeds, durations)

    def _choice(self, hits: Hits, shots: Shots, row: int, target: np.ndarray, error: float, use: float) -> Choice:
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
            shots.wanted[shot],
            shots.wanted[shot],
            hits.places[row],
            hits.normals[row],
            hits.velocities[row],
            int(shots.sides[shot]),
            hits.mobility[row],
            error,
            use,
        )

    def _refined(self, choice: Choice, shots: Shots, shot: int, start: State) -> Choice:
        """Return the choice with the law asked for what the simulated contact turns into the wanted velocity."""
        assert self.simulate is not None
        one, best = shots.take(np.array([shot])), choice
        for _ in range(self._options.rounds):
            wanted = choice.outgoing - self.simulate(best)
            asked = replace(one, wanted=wanted[None], seeds=best.positions[None])
            hits = solve(self._arm, self.law, asked)
            if not len(hits):
                break
            use = float(self._use(hits, asked, start)[0])
            if use > 1:
                break
            found = self._choice(hits, asked, 0, choice.target, choice.error, use)
            best = replace(found, outgoing=choice.outgoing)
        return best
