"""Parameters of the search for hits."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Options:
    """Parameters of the search for hits.

    time_step, flights: spacing of touch times and candidate flight times, s. soonest: shortest motion, s. seeds:
    postures for each shot. farthest: largest distance of a seed, m. most: maximum number of candidates that are solved.
    use: largest part of a limit in the quick estimate. first_use, last_use: the same for hits of a choice and of a
    correction that are left to the planner, after all others. time_shifts, flight_shifts: of a correction, s.
    shift_cost: m of landing error for each s of time shift. effort_cost: m of landing error for the use of a complete
    limit. rounds: of a simulated contact. settled: s after a bounce within which early_cost applies. early_cost,
    use_cost, edge_cost: m of landing error for each m of the ball's spread, right after a bounce, at the use of a
    complete limit, and at the end of a joint's range. keep_off: m; no hit after the ball came this near to the arm's
    base. room: rad to the ends of the joint ranges for each m of the ball's spread, below which edge_cost applies.
    touching: s before the touch, from when a swing that cannot be corrected is moved to at least touch the ball.
    follow_through: s after the middle of the contact for which the arm keeps its velocities before it stops.
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
    early_cost: float = 7.0
    use_cost: float = 1.0
    keep_off: float = 0.25
    room: float = 4.0
    edge_cost: float = 2.0
    touching: float = 0.25
    follow_through: float = 0.015
