"""Refusals: the codes of the wire contract and the exception that carries one."""

from collections.abc import Mapping
from typing import Any

CODES: Mapping[str, tuple[str, ...]] = {
    "bad_message": ("field",),
    "invalid_goal": ("field",),
    "unknown_primitive": ("name",),
    "unknown_goal": ("goal_id",),
    "exists": ("name",),
    "duplicate": ("goal_id",),
    "limit": ("joint", "quantity", "value", "bound"),
    "infeasible": ("joint", "quantity", "time_from_start", "min_duration", "waypoint_times"),
    "cannot_stop": ("joint", "max_velocity"),
    "unreachable": ("distance", "angle", "reason", "nearest"),
    "collision": ("body", "other", "time_from_start", "distance"),
    "solver_failed": ("joint", "status"),
    "late": ("goal_id",),
    "superseded": ("goal_id",),
    "busy": ("goal_id",),
    "not_holder": ("client_id",),
    "unavailable": ("service",),
    "fault": ("fault",),
    "wrong_clock": (),
}
"""Every code with the fields of its `detail`.

Some refusals have further fields: `unavailable` has the `goal_id` of a refused goal; `solver_failed` has
`min_duration` and `waypoint_times` if planning time ran out; `limit` of the quantity `torque` has these two and
`time_from_start`; the refusal of a goal with alternatives has `alternatives`, their codes.
"""


class Refusal(Exception):
    """A refused request: its owner replies with `reply_err`.

    `code` is one of `CODES`, `message` a sentence that a person can act on, `detail` holds at least the
    fields that `CODES` lists for the code.
    """

    def __init__(self, code: str, message: str, **detail: Any) -> None:
        missing = set(CODES[code]) - detail.keys()
        if missing:
            raise TypeError(f"a refusal with code {code!r} lacks the detail {sorted(missing)}")
        super().__init__(message)
        self.code = code
        self.message = message
        self.detail = detail


class NoAnswer(Exception):
    """A request got no reply: its owner does not run or does not answer, or the bus cannot be reached."""

    def __init__(self, service: str, key: str, reason: str = "") -> None:
        reason = reason or f"the {service} is not running, or not on this bus; start it"
        super().__init__(f"no answer on {key}: {reason}")
        self.service = service
        self.key = key
