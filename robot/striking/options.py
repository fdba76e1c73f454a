"""Parameters of the search for hits."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Options:
    """Parameters of the search for hits.

    A *use* is the largest part of any limit that a quintic to the hit uses. Costs are m of landing error.

    Attributes:
        time_step: Spacing of candidate touch times, s.
        flights: Candidate flight times, s.
        min_motion_time: Shortest motion, s.
        seeds: Number of initial postures for each shot.
        max_seed_distance: Largest distance of the racket in an initial posture, m.
        max_candidates: Largest number of candidates that are solved.
        use: Largest use of a hit that the planner will probably accept.
        max_first_use: Largest use of a first hit that is left to the planner, after all others.
        max_correction_use: The same for a correction.
        time_shifts: Changes of the touch time by a correction, s.
        flight_shifts: Changes of the flight time by a correction, s.
        shift_cost: For each s of time shift.
        effort_cost: At the use of a complete limit.
        rounds: Iterations with a simulated contact.
        settling_time: After a bounce `early_cost` decreases to 0 within this time, s.
        early_cost: Right after a bounce, for each m of the ball's spread.
        use_cost: At the use of a complete limit, for each m of the ball's spread.
        edge_cost: At the end of a joint's range, for each m of the ball's spread.
        edge_room: `edge_cost` applies nearer than this to the end of a range, rad for each m of the ball's spread.
        base_distance: No hit after the ball came this near to the arm's base, m.
        touch_time: From this time before the touch on, a swing that cannot be corrected is moved to at least touch the
            ball, s.
        follow_through: The arm keeps its velocities for this time after the middle of the contact, s.
    """

    time_step: float = 0.025
    flights: tuple[float, ...] = (0.4, 0.5, 0.6, 0.7, 0.8)
    min_motion_time: float = 0.15
    seeds: int = 2
    max_seed_distance: float = 0.25
    max_candidates: int = 260
    use: float = 0.97
    max_first_use: float = 1.4
    max_correction_use: float = 2.5
    time_shifts: tuple[float, ...] = (-0.06, -0.03, -0.01, 0.0, 0.01, 0.03, 0.06)
    flight_shifts: tuple[float, ...] = (-0.1, -0.05, 0.0, 0.05, 0.1)
    shift_cost: float = 0.3
    effort_cost: float = 0.06
    rounds: int = 2
    settling_time: float = 0.3
    early_cost: float = 7.0
    use_cost: float = 1.0
    edge_cost: float = 2.0
    edge_room: float = 4.0
    base_distance: float = 0.25
    touch_time: float = 0.25
    follow_through: float = 0.015
