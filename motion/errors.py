"""Errors of a requested motion. Each carries its evidence as attributes."""

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


class InvalidMotion(MotionError, ValueError):
    """A malformed request or demonstration; `field` is the name of the wrong field."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(f"{field}: {message}")
        self.field = field
        self.message = message


class LimitExceeded(MotionError):
    """A value that the request prescribes exceeds a limit; `bound` is that limit.

    `of` is appended to the value in the sentence, for example " of the start"; empty for the goal.
    """

    SENTENCE = (
        "joint {joint}: the requested {quantity} {value:.6g} {unit}{of} lies outside the limits; "
        "it must be {word} {bound:.6g} {unit}"
    )

    def __init__(self, joint: int, quantity: str, value: float, bound: float, of: str = "") -> None:
        word, unit = "at most" if value > bound else "at least", UNITS[quantity]
        super().__init__(
            self.SENTENCE.format(joint=joint, quantity=quantity, value=value, unit=unit, of=of, word=word, bound=bound)
        )
        self.joint = joint
        self.quantity = quantity
        self.value = value
        self.bound = bound


class PlanExceeds(LimitExceeded):
    """A plan of a method without guaranteed limits exceeds one; `value` is the plan's."""

    SENTENCE = (
        "joint {joint}: the {quantity} of the plan reaches {value:.6g} {unit}, but it must be {word} {bound:.6g} "
        "{unit}; method 'qp' keeps all limits, and a longer duration may work"
    )


LOOSEN = "loosen that limit, or change the start or the goal"
NONE_FOUND, NONE_TRIED = f"no longer duration was found to work; {LOOSEN}", f"allow more time, {LOOSEN}"
"""Advice for an infeasible request after a search of a longer duration that found none, and without a search."""


class Infeasible(MotionError):
    """No motion of the requested duration keeps the limits.

    `quantity` and `time` (s from the start) name the limit that is hardest to keep, and where. `min_duration` (s)
    is the shortest feasible duration that was found above the request, `waypoint_times` (s) the waypoints' times in it;
    both are None if none was found or tried, and the sentence then gives the advice `otherwise`.
    """

    def __init__(
        self,
        joint: int,
        quantity: str,
        time: float,
        min_duration: float | None = None,
        waypoint_times: list[float] | None = None,
        otherwise: str = NONE_TRIED,
    ) -> None:
        remedy = works_in(min_duration, waypoint_times, otherwise)
        super().__init__(f"joint {joint}: the {quantity} limit cannot be kept near {time:.3f} s; {remedy}")
        self.joint = joint
        self.quantity = quantity
        self.time = time
        self.min_duration = min_duration
        self.waypoint_times = waypoint_times


class CannotStop(MotionError):
    """No stop after the hit keeps the limits.

    `max_velocity` (rad/s, signed) is the highest final velocity, up to the requested one, from which the joint can
    stop; None if none was found, which a prescribed final acceleration can cause.
    """

    def __init__(self, joint: int, max_velocity: float | None) -> None:
        if max_velocity is None:
            remedy = "with this final acceleration no slower arrival was found that could; leave it free"
        else:
            remedy = f"a final velocity of {max_velocity:.6g} rad/s could be stopped"
        super().__init__(f"joint {joint}: the arm could not come to rest inside its limits after this goal; {remedy}")
        self.joint = joint
        self.max_velocity = max_velocity


class SolverFailed(MotionError):
    """The quadratic program failed numerically; `status` is the solver's status."""

    def __init__(self, joint: int, status: str, remedy: str = "change the goal a little") -> None:
        super().__init__(f"joint {joint}: the solver failed ({status}); {remedy}")
        self.joint = joint
        self.status = status


class OutOfTime(SolverFailed):
    """Planning exceeded its effort; the status is "time".

    `min_duration` (s) is a feasible duration, `waypoint_times` (s) are the waypoints' times in it; both are None if
    none was found.
    """

    def __init__(
        self, joint: int, min_duration: float | None = None, waypoint_times: list[float] | None = None
    ) -> None:
        super().__init__(
            joint, "time", works_in(min_duration, waypoint_times, "allow a longer duration or a later arrival")
        )
        self.min_duration = min_duration
        self.waypoint_times = waypoint_times
