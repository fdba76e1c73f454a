"""Decode and validate messages in batches."""

from collections.abc import Callable, Mapping, Sequence
from itertools import islice
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import msgspec

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import bad_message, check_lengths, decode, matrix
from protocol.errors import Refusal
from protocol.topics import MAX_PLAN_S, MIB, Publication
from robot.conversions import samples_of

MessageT = TypeVar("MessageT", bound=msgspec.Struct)

MAX_WAITING_STREAM = 1 << 14
"""Capacity of a stream's queue: 16 s at 1 kHz. A full queue drops the oldest; the gap in the ticks shows it."""

MAX_WAITING = 1 << 8
MAX_READINGS = 8
"""How often the plans of a batch are read again; more arrive meanwhile only in a deliberate flood."""
MAX_BODY_BYTES = 16 * MIB
MAX_TICK = 1 << 48
MAX_NS = 1 << 63
MAX_TIME_S = 1e9
MIN_DT_S = 1e-6
SPACE = 3
MAX_IN_SPACE = 1e6
"""Largest coordinate of a ball or another joint, m, rad or m/s."""


class Received(NamedTuple, Generic[MessageT]):
    """A message, and the time at which the router received it, Unix ns."""

    wall_ns: int
    message: MessageT


class Source(Protocol):
    """A queue of bodies: a `protocol.bus.queues.Collector`."""

    def take(self) -> tuple[bytes, int] | None:
        """Return the oldest body and its arrival, Unix ns, or None."""
        ...


def listen(bus: Bus) -> dict[Publication, Source]:
    """Subscribe to every topic that the topic table marks as recorded."""
    return {
        topic: bus.collect(topic, MAX_WAITING_STREAM if topic.stream else MAX_WAITING)
        for topic in topics.PUBLICATIONS
        if topic.recorded
    }


class Receiver:
    """Takes and validates the queued messages of every recorded topic.

    `malformed` counts the bodies that cannot be decoded; `complain` is called with a sentence and the refusal's code.
    """

    def __init__(
        self, sources: Mapping[Publication, Source], joint_count: int, complain: Callable[[str, str], None]
    ) -> None:
        self.malformed = 0
        self._sources = sources
        self._joint_count = joint_count
        self._complain = complain

    def take(self) -> dict[Publication, list[Received[Any]]]:
        """Return the messages since the last call, by topic, each in order of arrival.

        The table begins with the states, but their queue is read last, so that a batch contains the state of each of
        its messages. A batch with states of a motion must also contain its plan, so plans are read again if some
        arrived meanwhile, but not without end. Nothing is decoded before, because decoding takes longer than the lead
        of a plan.
        """
        waiting = {topic: self._drain(topic) for topic in reversed(list(self._sources))}
        for late in islice(iter(lambda: self._drain(topics.PLAN), []), MAX_READINGS):
            waiting[topics.PLAN] += late
            waiting[topics.STATE] += self._drain(topics.STATE)
        return {topic: self._read(topic, bodies) for topic, bodies in waiting.items()}

    def _drain(self, topic: Publication) -> list[tuple[bytes, int]]:
        source = self._sources[topic]
        return list(islice(iter(source.take, None), MAX_WAITING_STREAM))

    def _read(self, topic: Publication, bodies: list[tuple[bytes, int]]) -> list[Received[Any]]:
        taken = []
        for body, wall_ns in bodies:
            try:
                taken.append(Received(wall_ns, read(topic, body, self._joint_count)))
            except Refusal as refusal:
                self.malformed += 1
                self._complain(f"a malformed message on {topic.key} was left out: {refusal}", refusal.code)
        return taken


RANGES: dict[type, dict[str, float]] = {
    m.State: {"tick": MAX_TICK, "run": MAX_NS, "time": MAX_TIME_S},
    m.Command: {"tick": MAX_TICK, "run": MAX_NS},
    m.Status: {"time": MAX_TIME_S},
    m.Result: {
        **{f"stamps.{name}": MAX_NS for name in m.Stamps.__struct_fields__},
        "hit.time": MAX_TIME_S,
        "saturated_ticks": MAX_TICK,
        "first_contact.time": MAX_TIME_S,
    },
    m.Plan: {"start_time": MAX_TIME_S, "epoch": MAX_NS, "phase": 1.0},
    m.Refused: {"requested": MAX_NS},
    m.Disturbance: {"time": MAX_TIME_S},
    m.BallState: {"time": MAX_TIME_S},
    m.Scene: {"time": MAX_TIME_S},
    m.Contact: {"time": MAX_TIME_S},
    m.Strike: {"time": MAX_TIME_S, "revisions": MAX_TICK},
}
"""Fields that are at least 0 and less than a bound."""

OF_JOINTS: dict[type, tuple[str, ...]] = {
    m.State: (
        "positions",
        "velocities",
        "torques",
        "saturated",
        "truth.positions",
        "truth.velocities",
        "accelerations",
    ),
    m.Command: ("accelerations", "positions", "velocities"),
    m.Status: ("error.positions", "error.velocities"),
    m.Result: ("hit.position_error", "hit.velocity_error"),
    m.Plan: ("joint_names", *(f"limits.{name}" for name in m.PlanLimits.__struct_fields__)),
}
"""Fields with an entry for each joint."""

IN_SPACE: dict[type, tuple[str, ...]] = {
    m.BallState: ("position", "velocity"),
    m.Contact: ("ball_velocity",),
    m.Strike: (
        *(f"{part}.{vector}" for part in ("prediction", "racket", "hit") for vector in ("position", "velocity")),
        "landing.position",
    ),
}
"""Fields that are vectors in space."""


def read(topic: Publication[MessageT], body: bytes, joint_count: int) -> MessageT:
    """Return the message in `body`, validated so that it can be written for an arm of `joint_count` joints.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    message, kind = decode(body, topic.message, MAX_BODY_BYTES), topic.message
    for field, bound in RANGES[kind].items():
        _check_range(field, _value_at(message, field), bound)
    vectors = {field: _value_at(message, field) for field in OF_JOINTS.get(kind, ())}
    check_lengths(joint_count, **{field: vector for field, vector in vectors.items() if vector is not None})
    for field in IN_SPACE.get(kind, ()):
        _check_in_space(field, _value_at(message, field))
    match message:
        case m.Plan():
            _check_plan(message, joint_count)
        case m.Scene():
            _check_scene(message)
        case m.Disturbance():
            _check_disturbance(message, joint_count)
        case m.Strike():
            for place in message.prediction.path if message.prediction else ():
                _check_in_space("prediction.path", place)
    return message


def _value_at(message: Any, field: str) -> Any:
    """Return the value of a field such as `hit.time`, or None if it or its parent is null."""
    for name in field.split("."):
        message = getattr(message, name, None)
    return message


def _check_plan(plan: m.Plan, joint_count: int) -> None:
    """Refuse a plan whose matrices or waypoints do not fit each other."""
    # A long motion is sampled coarsely, and its last sample is after its end.
    if not (0 <= plan.hit_index < plan.count and plan.dt >= MIN_DT_S and plan.dt * plan.count <= 2 * MAX_PLAN_S):
        raise bad_message("count", f"count {plan.count}, hit_index {plan.hit_index}, dt {plan.dt} are not a trajectory")
    samples_of(plan)
    if plan.demonstration:
        matrix(plan.demonstration, plan.hit_index + 1, joint_count, "demonstration")
    for waypoint in plan.waypoints:
        if waypoint.positions is not None and len(waypoint.positions) != joint_count:
            raise bad_message("waypoints", f"waypoints: one has {len(waypoint.positions)} positions, not {joint_count}")
        if abs(waypoint.time_from_start) > MAX_TIME_S:
            raise bad_message("waypoints", f"waypoints: time_from_start {waypoint.time_from_start} is not a time")


def _check_disturbance(disturbance: m.Disturbance, joint_count: int) -> None:
    for active in disturbance.active:
        if active.kind == "wind":
            _check_in_space("active.values", active.values)
        elif active.values is not None:
            check_lengths(joint_count, **{"active.values": active.values})


def _check_scene(scene: m.Scene) -> None:
    for name, coordinates in scene.joints.items():
        if max(map(abs, coordinates), default=0.0) > MAX_IN_SPACE:
            raise bad_message("joints", f"joints: {name} is at {coordinates}; at most {MAX_IN_SPACE:g} can be shown")


def _check_range(field: str, value: float | None, bound: float) -> None:
    if value is not None and not 0 <= value < bound:
        raise bad_message(field, f"{field} is {value}; it must be at least 0 and less than {bound:g}")


def _check_in_space(field: str, vector: Sequence[float] | None) -> None:
    if vector is None:
        return
    if len(vector) != SPACE:
        raise bad_message(field, f"{field} has {len(vector)} entries; space has {SPACE}")
    if max(map(abs, vector)) > MAX_IN_SPACE:
        raise bad_message(field, f"{field} is {list(vector)}; at most {MAX_IN_SPACE:g} can be shown")
