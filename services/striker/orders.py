"""The order of the striker: a checked request."""

import math
from dataclasses import dataclass

import numpy as np

from protocol import messages as m
from protocol.codec import bad_message

MAX_RANGE_M = 100.0
MAX_FLIGHT_S = 10.0
MAX_REVISE_HZ = 1000.0
MAX_UNTIL_S = 1.0
MAX_COUNT = 1_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Order:
    """A checked `strike` request.

    target: (3,), m, where the balls must land. flight_time: s from the touch until then, None: the striker chooses.
    primitives: allowed for imitation, empty: all of the library. period: s between corrections, inf: none. until: s
    before the touch after which there are no corrections.
    """

    target: np.ndarray
    flight_time: float | None
    primitives: tuple[str, ...]
    period: float
    until: float


def order_of(request: m.StrikeRequest) -> Order:
    """Return a request as an order.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    if max(map(abs, request.target)) > MAX_RANGE_M:
        raise bad_message("target", f"target is {list(request.target)}; it must lie within {MAX_RANGE_M:g} m of 0")
    _check("flight_time", request.flight_time, 0.0, MAX_FLIGHT_S, "s, or null for the striker's choice")
    _check("count", request.count, 0, MAX_COUNT, "balls, or null for any number")
    if not 0 <= request.revise_hz <= MAX_REVISE_HZ:
        sentence = f"revise_hz is {request.revise_hz}; it must be 0 (plan once) to {MAX_REVISE_HZ:g}"
        raise bad_message("revise_hz", sentence)
    if not 0 <= request.until_s <= MAX_UNTIL_S:
        raise bad_message("until_s", f"until_s is {request.until_s}; it must be 0 to {MAX_UNTIL_S:g} s")
    if request.primitives is not None and not request.primitives:
        raise bad_message("primitives", "primitives is empty; name one, or send null for any of the library")
    return Order(
        target=np.array(request.target, dtype=float),
        flight_time=request.flight_time,
        primitives=tuple(request.primitives or ()),
        period=1 / request.revise_hz if request.revise_hz else math.inf,
        until=request.until_s,
    )


def _check(field: str, value: float | None, low: float, high: float, rest: str) -> None:
    if value is not None and not low < value <= high:
        raise bad_message(field, f"{field} is {value}; it must be more than {low:g} and at most {high:g} {rest}")
