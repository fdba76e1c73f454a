"""Choose when, where and how to hit a ball so that it lands at a target, and correct that choice."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain, islice

import numpy as np

from robot.striking.arm import Arm
from robot.striking.choice import Choice, NoHit, State, are_similar
from robot.striking.contact import ContactLaw, first_normal
from robot.striking.flight import Court, aim, net_clearance
from robot.striking.hits import Hits, Shots, choice_of, meets, solve, touch
from robot.striking.landing import correction_cost, landing_error
from robot.striking.options import Options
from robot.striking.path import Path
from robot.striking.quintic import quintic_use
from robot.striking.reachability import Reachability
from robot.striking.touch_times import touch_times

TOUCH_SHIFTS = -0.06, -0.04, -0.02, 0.0, 0.02, 0.04, 0.06
"""s, changes of the touch time that are tried for a touch."""
TOUCHES = 2
"""Largest number of touches."""
BLOCKED = 0.5
"""Speed of a blocked ball after the hit, as a part of its speed before."""
Shifts = tuple[float, ...]
ContactModel = Callable[[Choice], np.ndarray]
"""Simulates a hit: returns the difference (3,), m/s, of the outgoing velocity from the contact law's."""


class Chooser:
    """Chooses hits of one arm on one court.

    law: the contact law; assign a learned one at any time. simulate: a finer model of the contact, None for the law
    alone. may_play: returns whether a hit may be played.
    """

    def __init__(
        self,
        arm: Arm,
        reachability: Reachability,
        court: Court,
        law: ContactLaw,
        options: Options | None = None,
        simulate: ContactModel | None = None,
        may_play: Callable[[Choice], bool] = lambda _: True,
    ) -> None:
        self.law = law
        self.simulate = simulate
        self._may_play = may_play
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
        within: float = np.inf,
        refine: bool = True,
    ) -> Iterator[Choice]:
        """Return up to `count` hits of a ball on `path`, the one with the least expected landing error first.

        start: state in which the arm's motion begins. target: (3,), m, where the ball must touch the surface.
        flight_time: s, any if None. earliest: s, earliest touch. within: m, upper bound of the expected landing error.
        refine: apply `refined` to the first hit; corrections have no time for it. Later hits are checked by `may_play`
        when they are taken.

        Raises:
            NoHit: no hit is possible.
        """
        options = self._options
        flights = options.flights if flight_time is None else (flight_time,)
        times = touch_times(path, self._arm.fixed_points, options, start.time, earliest)
        shots = self._shots(path, np.repeat(times, len(flights)), np.tile(flights, len(times)), target)
        seeded = self._seeded(shots, start, first_normal(shots.incoming, shots.wanted))
        hits = solve(self._arm, self.law, seeded)
        found = self._ranked(hits, seeded, start, target, count, None, within=within)
        return chain([self.refined(next(found), start)], found) if refine else found

    def blocks(self, path: Path, start: State, target: np.ndarray, count: int = 8) -> Iterator[Choice]:
        """Return hits that send a ball back in the direction it comes from, more slowly. Raises NoHit."""
        times = touch_times(path, self._arm.fixed_points, self._options, start.time)
        flights = np.full(len(times), np.median(self._options.flights))
        shots = self._shots(path, times, flights, target, must_clear=False)
        shots = self._seeded(shots, start, first_normal(shots.incoming, -shots.incoming))
        back = replace(shots, wanted=-BLOCKED * shots.incoming)
        hits = solve(self._arm, self.law, back)
        law_error = (back.wanted - shots.wanted)[hits.shots]
        error = landing_error(self.law, self._arm, hits, shots, law_error)
        found = self._ranked(hits, back, start, target, count, None, error)
        return chain([self.refined(next(found), start)], found)

    def correct(
        self, path: Path, start: State, target: np.ndarray, last: Choice, earliest: float = -np.inf, count: int = 4
    ) -> Iterator[Choice]:
        """Return hits near `last`, sorted as by `choose`, for a newer estimate of the ball.

        start: state in which the corrected motion begins. Hits for which a quintic exceeds the limits come last, the
        one with the least excess first, since the planner may still find a motion. Pass the hit that is played to
        `with_simulated_contact`. Raises NoHit.
        """
        options = self._options
        shifts = tuple(shift for shift in options.time_shifts if last.time + shift >= earliest)
        shots = self._near(path, start, target, last, shifts, options.flight_shifts)
        hits = solve(self._arm, self.law, shots, last.mobility)
        return self._ranked(hits, shots, start, target, count, last)

    def touches(self, path: Path, start: State, target: np.ndarray, last: Choice) -> list[Choice]:
        """Return hits similar to `last` that touch the ball, wherever it lands, when `correct` found no plan.

        Empty if `last` touches the ball, or if there is time for a later correction.
        """
        if last.time - start.time >= self._options.touch_time or meets(self._arm, path, last):
            return []
        try:
            shots = self._near(path, start, target, last, TOUCH_SHIFTS, None)
            hits = touch(self._arm, self.law, shots, last)
            shots = shots.take(hits.shots)
            hits = replace(hits, shots=np.arange(len(shots)))
            ball = self._arm.ball
            leaves = self.law.outgoing(ball.mass, hits.mobility, shots.incoming, hits.velocities, hits.normals)
            error = landing_error(self.law, self._arm, hits, shots, leaves - shots.wanted)
            return list(self._ranked(hits, replace(shots, wanted=leaves), start, target, TOUCHES, last, error))
        except NoHit:
            return []

    def _near(
        self, path: Path, start: State, target: np.ndarray, last: Choice, shifts: Shifts, flight_shifts: Shifts | None
    ) -> Shots:
        """Return the shots near the last hit. Raises NoHit if there are none.

        Without `flight_shifts` the flight time is the last one, and the net is ignored.
        """
        times = last.time + np.array(shifts)
        times = times[(times > start.time) & (times > path.times[0]) & (times < path.times[-1])]
        times = times[path.bounced(times) % 1 == 0] if len(times) else times
        if not len(times):
            raise NoHit("late", "the ball is not where it was expected at any time near to the hit")
        flights = np.maximum(last.flight_time + np.array(flight_shifts or (0.0,)), 0.1)
        times, flights = np.repeat(times, len(flights)), np.tile(flights, len(times))
        shots = self._shots(path, times, flights, target, must_clear=flight_shifts is not None)
        seeds = np.broadcast_to(last.positions, (len(shots), len(last.positions)))
        sides = np.full(len(shots), last.side)
        return replace(shots, wanted=shots.wanted - last.law_error, sides=sides, seeds=seeds)

    def refined(self, choice: Choice, start: State) -> Choice:
        """Return the hit adjusted so that its simulated contact gives the wanted outgoing velocity.

        `choose` does this for its first hit.
        """
        if self.simulate is None:
            return choice
        nothing = np.zeros((1, 3))
        rows = [[choice.time], [choice.flight_time], [np.inf], choice.ball[None], choice.incoming[None]]
        best = choice
        for _ in range(self._options.rounds):
            law_error = self.simulate(best)
            wanted, sides = (choice.outgoing - law_error)[None], [choice.side]
            tail = np.zeros((1, 6, 6)), wanted, nothing, sides, best.positions[None]
            asked = Shots(*(np.asarray(value, dtype=float) for value in (*rows, *tail)))
            hits = solve(self._arm, self.law, asked)
            if not len(hits):
                break
            use = float(self._use(hits, asked, start)[0])
            better = choice_of(hits, asked, 0, self.law, choice.target, choice.error, use, law_error)
            if use > 1 or not self._may_play(better):
                break
            best = better
        return best

    def with_simulated_contact(self, choice: Choice) -> Choice:
        """Return the hit with the result of its simulated contact, for its next correction and for learning.

        `correct` does not simulate, so that this can be done while the planner plans. The result is reused for similar
        hits.
        """
        if self.simulate is None:
            return choice
        if self._simulated is None or not are_similar(choice, self._simulated[0]):
            self._simulated = choice, self.simulate(choice)
        return replace(choice, law_error=self._simulated[1])

    def _shots(
        self, path: Path, times: np.ndarray, flights: np.ndarray, target: np.ndarray, must_clear: bool = True
    ) -> Shots:
        """Return all shots to the target, with `must_clear` those that clear the net. Raises NoHit without any."""
        ball, net = self._arm.ball, self._court.net
        positions, incoming = path.at(times)
        goal = target + np.array([0.0, 0.0, ball.radius])
        # During the contact the ball moves with the mean of both velocities.
        wanted, leaves, arrivals = aim(ball, path.air, positions, goal, flights, incoming, self.law.duration)
        clears = np.ones(len(times), dtype=bool)
        if must_clear:
            clears &= arrivals[:, 2] < 0
        if must_clear and net is not None:
            clears &= net_clearance(ball, path.air, net, leaves, wanted, flights) >= self._court.clearance
        if not clears.any():
            raise NoHit("target", "no flight from the ball's path to the target comes down on it and clears the net")
        covariances, ages = path.covariance(times), path.since_bounce(times)
        sides, nothing = np.ones(len(times)), np.zeros((len(times), 0))
        shots = Shots(times, flights, ages, positions, incoming, covariances, wanted, arrivals, sides, nothing)
        return shots.take(np.flatnonzero(clears))

    def _seeded(self, shots: Shots, start: State, normals: np.ndarray) -> Shots:
        """Return the shots with the nearest postures of the table as seeds. Raises NoHit if none is near.

        normals: (n, 3), of the racket on the ball's side.
        """
        arm, options = self._arm, self._options
        sides = (1, -1) if arm.racket.two_sided else (1,)
        places = np.tile(shots.positions - arm.offset * normals, (len(sides), 1))
        signs = np.repeat(sides, len(shots))
        faces = signs[:, None] * np.tile(normals, (len(sides), 1))
        seeds, away = self._reachability.seeds(places, faces, start.positions, self._scale, options.seeds)
        order = np.argsort(away, axis=None, kind="stable")[: options.max_candidates]
        order = order[away.ravel()[order] < options.max_seed_distance]
        if not len(order):
            raise NoHit("out of reach", f"the racket comes nowhere within {away.min():.2f} m of the ball's path")
        rows = order // away.shape[1]
        picked = shots.take(rows % len(shots))
        return replace(picked, sides=signs[rows], seeds=seeds.reshape(-1, seeds.shape[2])[order])

    def _ranked(
        self,
        hits: Hits,
        shots: Shots,
        start: State,
        target: np.ndarray,
        count: int,
        last: Choice | None,
        error: np.ndarray | None = None,
        within: float = np.inf,
    ) -> Iterator[Choice]:
        """Return the best hits, at least one. error: m, None: expected; must be below `within`. Raises NoHit."""
        options = self._options
        if not len(hits):
            raise NoHit("out of reach", "no posture has the racket where the ball comes by, turned to the target")
        use = self._use(hits, shots, start)
        stops = np.flatnonzero(np.isfinite(use))
        if not len(stops):
            raise NoHit("limits", "after every hit the arm could not come to rest inside its joints' ranges")
        hits, use, error = hits.take(stops), use[stops], None if error is None else error[stops]
        most = options.max_first_use if last is None else options.max_correction_use
        if use.min() > most:
            raise NoHit("limits", f"the easiest hit needs {use.min():.2f} of the arm's limits")
        if error is None:
            error = landing_error(self.law, self._arm, hits, shots)
        if last is None:
            cost = error + correction_cost(self._arm, options, hits, shots, use)
        else:
            cost = error + options.shift_cost * np.abs(shots.times[hits.shots] - last.time) + options.effort_cost * use
        hard = use > options.use
        order = np.lexsort([np.where(hard, use, cost), hard])
        order = order[(use[order] <= most) & (error[order] < within)]
        law_error = np.zeros(3) if last is None else last.law_error
        law, errors, uses = self.law, error.tolist(), use.tolist()
        found = (choice_of(hits, shots, row, law, target, errors[row], uses[row], law_error) for row in order.tolist())
        playable = filter(self._may_play, found)
        best = next(playable, None)
        if best is None:
            raise NoHit("room", "the recoil of every hit would throw the arm into what stands around it")
        return chain([best], islice(playable, count - 1))

    def _use(self, hits: Hits, shots: Shots, start: State) -> np.ndarray:
        begin = start.positions, start.velocities, start.accelerations
        durations = shots.times[hits.shots] + self.law.duration / 2 - start.time
        follow_through = self._options.follow_through
        return quintic_use(self._arm.limits, begin, hits.postures, hits.joint_velocities, durations, follow_through)
