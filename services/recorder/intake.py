"""From the bus to checked messages: a bounded queue that never makes a publisher wait."""

import math
import threading
import time
from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import msgpack
import msgspec

from protocol import messages as m
from protocol import topics
from protocol.bus import Bus
from protocol.codec import bad_message, decode, matrix
from protocol.errors import Refusal
from protocol.topics import MIB, Publication

Said = TypeVar("Said", bound=msgspec.Struct)

MAX_WAITING_BYTES = 64 * MIB
MAX_BODY_BYTES = 16 * MIB
OVERHEAD_BYTES = 200  # what Python keeps beside a body
MAX_TICK = 1 << 48
MAX_RUN = 1 << 63
MAX_TIME_S = 1e9
STATE_VECTORS = ("positions", "velocities", "torques", "saturated")
COMMAND_VECTORS = ("accelerations", "positions", "velocities")


class Received(NamedTuple, Generic[Said]):
    """A message and when it came, Unix ns."""

    wall_ns: int
    message: Said


class Intake:
    """Collects the bodies of every recorded topic.

    `lost` counts those that found the queue full, `malformed` those that could not be read.
    """

    def __init__(self, joint_count: int, complain: Callable[[str], None]) -> None:
        self.lost = 0
        self.malformed = 0
        self._joint_count = joint_count
        self._complain = complain
        self._lock = threading.Lock()
        self._waiting: list[tuple[Publication, int, bytes]] = []
        self._bytes = 0

    def listen(self, bus: Bus) -> None:
        """Subscribe to everything the topic table says is recorded."""
        for topic in topics.PUBLICATIONS:
            if topic.recorded:
                bus.listen(topic, self._receiver(topic))

    def take(self) -> dict[Publication, list[Received[Any]]]:
        """Return what has come since the last call, by topic, each in order of arrival."""
        with self._lock:
            waiting, self._waiting, self._bytes = self._waiting, [], 0
        taken: dict[Publication, list[Received[Any]]] = {}
        for topic, wall_ns, body in waiting:
            try:
                message = read(topic, body, self._joint_count)
            except Refusal as refusal:
                self.malformed += 1
                self._complain(f"a malformed message on {topic.key} was left out: {refusal}")
            else:
                taken.setdefault(topic, []).append(Received(wall_ns, message))
        return taken

    def offer(self, topic: Publication, body: bytes) -> None:
        """Queue a body, or count it as lost where too much waits already."""
        size = len(body) + OVERHEAD_BYTES
        with self._lock:
            if self._bytes + size > MAX_WAITING_BYTES:
                self.lost += 1
                return
            self._bytes += size
            self._waiting.append((topic, time.time_ns(), body))

    def _receiver(self, topic: Publication) -> Callable[[bytes], None]:
        return lambda body: self.offer(topic, body)


def read(topic: Publication[Said], body: bytes, joint_count: int) -> Said:
    """Return the message in `body`, checked to be drawable for an arm of `joint_count` joints.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    message = _read_stream(topic, body) if topic.stream else decode(body, topic.message, MAX_BODY_BYTES)
    _check_numbers(message)
    for field, values in _vectors(message):
        if len(values) != joint_count:
            raise bad_message(field, f"{field} has {len(values)} entries; the arm has {joint_count} joints")
    if isinstance(message, m.Plan):
        _check_plan(message, joint_count)
    return message


def _read_stream(topic: Publication[Said], body: bytes) -> Said:
    """Decode without the codec's walk over every number, a third of its cost at 1 kHz; a sum finds what is not finite.

    Whatever looks wrong goes to the codec, which says what is.
    """
    try:
        message = msgspec.convert(msgpack.unpackb(body), topic.message, builtin_types=(bytes,))
        vectors = _vectors(message)
    except (ValueError, TypeError, msgpack.UnpackException):
        return decode(body, topic.message, MAX_BODY_BYTES)
    if not math.isfinite(sum(sum(values) for _, values in vectors)):
        return decode(body, topic.message, MAX_BODY_BYTES)
    return message


def _check_numbers(message: msgspec.Struct) -> None:
    """Refuse what would not fit on a timeline."""
    for field, bound in (("tick", MAX_TICK), ("run", MAX_RUN), ("time", MAX_TIME_S), ("start_time", MAX_TIME_S)):
        value = getattr(message, field, 0)
        if not 0 <= value < bound:
            raise bad_message(field, f"{field} is {value}; it must be at least 0 and less than {bound:g}")


def _check_plan(plan: m.Plan, joint_count: int) -> None:
    """Refuse a plan whose matrices, limits or way-points do not fit each other."""
    if not 0 <= plan.hit_index < plan.count or not 0 < plan.dt < MAX_TIME_S:
        raise bad_message("count", f"count {plan.count}, hit_index {plan.hit_index}, dt {plan.dt} are no trajectory")
    for field in ("positions", "velocities", "accelerations"):
        matrix(getattr(plan, field), plan.count, joint_count, field)
    if plan.demonstration:
        matrix(plan.demonstration, plan.hit_index + 1, joint_count, "demonstration")
    for kind, field in ((list[m.Range | None], "positions"), (m.PartialVector, "velocities, accelerations")):
        for name in field.split(", "):
            try:
                msgspec.convert(getattr(plan.limits, name), kind)
            except msgspec.ValidationError as error:
                raise bad_message(f"limits.{name}", f"limits.{name}: {error}") from None
    for waypoint in plan.waypoints:
        if waypoint.positions is not None and len(waypoint.positions) != joint_count:
            raise bad_message("waypoints", f"a way-point has {len(waypoint.positions)} positions, not {joint_count}")
        if abs(waypoint.time_from_start) > MAX_TIME_S:
            raise bad_message("waypoints", f"time_from_start {waypoint.time_from_start} is no time of a motion")


def _vectors(message: Any) -> list[tuple[str, list[Any]]]:
    """The fields of a message that have one entry a joint."""
    if isinstance(message, m.State):
        truth = _points("truth", message.truth) if message.truth else []
        return [(field, getattr(message, field)) for field in STATE_VECTORS] + truth
    if isinstance(message, m.Command):
        return [(field, getattr(message, field)) for field in COMMAND_VECTORS]
    if isinstance(message, m.Plan):
        limits = [(f"limits.{field}", getattr(message.limits, field)) for field in m.PerQuantity.__struct_fields__]
        return [("joint_names", message.joint_names), *limits]
    if isinstance(message, m.Status):
        return _points("error", message.error)
    if isinstance(message, m.Result) and message.hit:
        return [("hit.position_error", message.hit.position_error), ("hit.velocity_error", message.hit.velocity_error)]
    if isinstance(message, m.Disturbance):
        return [("active.values", active.values) for active in message.active if active.values is not None]
    return []


def _points(field: str, point: m.Point) -> list[tuple[str, list[Any]]]:
    return [(f"{field}.positions", point.positions), (f"{field}.velocities", point.velocities)]
