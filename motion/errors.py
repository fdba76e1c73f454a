"""Errors of a requested motion. Each carries its evidence as attributes."""

from dataclasses import dataclass, field

from motion.listing import listed


class MotionError(Exception):
    """Base of all errors of this package; `str()` is a sentence that says what to change. Joints are given by index."""


UNITS = {"position": "rad", "velocity": "rad/s", "acceleration": "rad/s²", "jerk": "rad/s³"}
"""Unit of each quantity of a joint."""


def works_in(min_duration: float | None, waypoint_times: list[float] | None, otherwise: str) -> str:
    """Return the advice to use a duration (s) that works, with its waypoints' times (s); `otherwise` without one."""
    if min_duration is None:
        return otherwise
    waypoints = listed([f"{t:.6g} s" for t in waypoint_times or []])
    return f"a duration of {min_duration:.6g} s works" + (f" with waypoints at {waypoints}" if waypoints else "")


@dataclass(eq=False)
class InvalidMotion(MotionError, ValueError):
    """A malformed request or demonstration; `field` is the name of the wrong field."""

    field: str
    message: str

    def __str__(self) -> str:
        return f"{self.field}: {self.message}"


@dataclass(eq=False)
class LimitExceeded(MotionError):
    """A value that the request prescribes exceeds a limit; `bound` is that limit.

    `of` is appended to the value in the sentence, for example " of the start"; empty for the goal.
    """

    joint: int
    quantity: str
    value: float
    bound: float
    of: str = ""

    def __str__(self) -> str:
        unit = UNITS[self.quantity]
        value = f"requested {self.quantity} {self.value:.6g} {unit}{self.of}"
        return f"joint {self.joint}: the {value} lies outside the limits; it must be {self.admissible} {unit}"

    @property
    def admissible(self) -> str:
        """The limit, as "at most 1.5"."""
        return f"{'at most' if self.value > self.bound else 'at least'} {self.bound:.6g}"


class PlanExceeds(LimitExceeded):
    """A plan of a method without guaranteed limits exceeds one; `value` is the plan's."""

    def __str__(self) -> str:
        unit = UNITS[self.quantity]
        return (
            f"joint {self.joint}: the {self.quantity} of the plan reaches {self.value:.6g} {unit}, but it must be "
            f"{self.admissible} {unit}; method 'qp' keeps all limits, and a longer duration may work"
        )


LOOSEN = "loosen that limit, or change the start or the goal"
NONE_FOUND, NONE_TRIED = f"no longer duration was found to work; {LOOSEN}", f"allow more time, {LOOSEN}"
"""Advice for an infeasible request after a search of a longer duration that found none, and without a search."""


@dataclass(eq=False)
class Infeasible(MotionError):
    """No motion of the requested duration keeps the limits.

    `quantity` and `time` (s from the start) name the limit that is hardest to keep, and where; `bounds` are its lowest
    and highest value. `min_duration` (s) is the shortest feasible duration that was found above the request,
    `waypoint_times` (s) the waypoints' times in it; both are None if none was found or tried, and the sentence then
    gives the advice `otherwise`.
    """

    joint: int
    quantity: str
    time: float
    bounds: tuple[float, float]
    min_duration: float | None = None
    waypoint_times: list[float] | None = None
    otherwise: str = NONE_TRIED

    def __str__(self) -> str:
        remedy = works_in(self.min_duration, self.waypoint_times, self.otherwise)
        low, high = self.bounds
        limit = f"{high:.6g}" if low == -high else f"{low:.6g} to {high:.6g}"
        return (
            f"joint {self.joint}: the {self.quantity} limit of {limit} {UNITS[self.quantity]} cannot be kept near "
            f"{self.time:.3f} s; {remedy}"
        )


@dataclass(eq=False)
class CannotStop(MotionError):
    """No stop after the hit keeps the limits.

    `max_velocity` (rad/s, signed) is the highest final velocity, up to the requested one, from which the joint can
    stop; None if none was found, which a prescribed final acceleration can cause.
    """

    joint: int
    max_velocity: float | None

    def __str__(self) -> str:
        if self.max_velocity is None:
            remedy = "with this final acceleration no slower arrival was found that could; leave it free"
        else:
            remedy = f"a final velocity of {self.max_velocity:.6g} rad/s could be stopped"
        return f"joint {self.joint}: the arm could not come to rest inside its limits after this goal; {remedy}"


@dataclass(eq=False)
class SolverFailed(MotionError):
    """The quadratic program failed numerically; `status` is the solver's status."""

    joint: int
    status: str

    def __str__(self) -> str:
        return f"joint {self.joint}: the solver failed ({self.status}); {self.remedy}"

    @property
    def remedy(self) -> str:
        """What to change."""
        return "change the goal a little"


@dataclass(eq=False)
class OutOfTime(SolverFailed):
    """Planning exceeded its effort; the status is "time".

    `min_duration` (s) is a feasible duration, `waypoint_times` (s) are the waypoints' times in it; both are None if
    none was found.
    """

    status: str = field(init=False, default="time")
    min_duration: float | None = None
    waypoint_times: list[float] | None = None

    @property
    def remedy(self) -> str:
        """What to change."""
        return works_in(self.min_duration, self.waypoint_times, "allow a longer duration or a later arrival")
