"""How hits are searched for."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Options:
    """How hits are searched for.

    time_step, flights: candidates, s. soonest: shortest motion, s. seeds: postures for each. farthest: of a seed, m.
    most: candidates that are looked at closely. use: largest part of a limit in the quick estimate; first_use and
    last_use: the same of hits that a choice and a correction leave to the planner, after all others. time_shifts,
    flight_shifts: what a correction tries, s. shift_cost: m of landing error that a second of the first is worth.
    effort_cost: the same of all of the limits. rounds: of a simulated contact. settled: s after a bounce, until when
    young_cost counts, m of landing error for a m of the ball's spread; use_cost: the same for all of the limits.
    keep_off: m; no hit after the ball came so near to the arm's base. room: rad to the ends of the joints' ranges that
    a m of the ball's spread asks for; edge_cost: m of landing error for a m of the spread where there is none.
    touching: s before the touch, from when on a swing that cannot be corrected is moved to touch the ball at least.
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
    young_cost: float = 7.0
    use_cost: float = 1.0
    keep_off: float = 0.25
    room: float = 4.0
    edge_cost: float = 2.0
    touching: float = 0.25
    follow_through: float = 0.015
