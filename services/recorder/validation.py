"""Bodies from the bus, decoded and validated in batches."""

from collections.abc import Callable, Mapping
from itertools import islice
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import msgspec

from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import bad_message, check_lengths, decode, matrix
from protocol.errors import Refusal
from protocol.topics import MIB, Publication
from robot.conversions import samples_of

MessageT = TypeVar("MessageT", bound=msgspec.Struct)

MAX_WAITING_STREAM = 1 << 14
"""Capacity of a stream's queue: 16 s at 1 kHz. Beyond it the oldest are lost, which the gap in their ticks shows."""

MAX_WAITING = 1 << 8
MAX_BODY_BYTES = 16 * MIB
MAX_TICK = 1 << 48
MAX_NS = 1 << 63
MAX_TIME_S = 1e9
MIN_DT_S = 1e-6
MAX_IN_SPACE = 1e6
"""Largest coordinate of a ball or another joint, m, rad or m/s."""


class Received(NamedTuple, Generic[MessageT]):
    """A message and when the router had it, Unix ns."""

    wall_ns: int
    message: MessageT


class Source(Protocol):
    """A queue of bodies: a `protocol.bus.queues.Collector`."""

    def take(self) -> tuple[bytes, int] | None:
        """Return the oldest body and when it came, Unix ns, or None."""
        ...


def listen(bus: Bus) -> dict[Publication, Source]:
    """Subscribe to every topic that the topic table marks as recorded."""
    return {
        topic: bus.collect(topic, MAX_WAITING_STREAM if topic.stream else MAX_WAITING)
        for topic in topics.PUBLICATIONS
        if topic.recorded
    }


class Receiver:
    """Takes and validates what waits on every recorded topic.

    `malformed` counts the bodies that could not be read; `complain` gets a sentence and the refusal's code for each.
    """

    def __init__(
        self, sources: Mapping[Publication, Source], joint_count: int, complain: Callable[[str, str], None]
    ) -> None:
        self.malformed = 0
        self._sources = sources
        self._joint_count = joint_count
        self._complain = complain

    def take(self) -> dict[Publication, list[Received[Any]]]:
        """Return what has arrived since the last call, by topic, each in order of arrival.

        The table begins with the states. They are taken last, so that a batch has the state behind each of its
        messages. All bodies are taken before the first is decoded, because decoding takes longer than the lead of a
        plan: a batch with states of a plan has the plan too.
        """
        waiting = {topic: self._drain(topic) for topic in reversed(list(self._sources))}
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


def read(topic: Publication[MessageT], body: bytes, joint_count: int) -> MessageT:
    """Return the message in `body`, validated so that it can be written for an arm of `joint_count` joints.

    Raises:
        Refusal: `bad_message`, naming the field.
    """
    message = decode(body, topic.message, MAX_BODY_BYTES)
    CHECKS[topic.message](message, joint_count)
    return message


def _check_tick(message: m.State | m.Command) -> None:
    _check_range("tick", message.tick, MAX_TICK)
    _check_range("run", message.run, MAX_NS)


def _check_state(state: m.State, joint_count: int) -> None:
    _check_tick(state)
    _check_range("time", state.time, MAX_TIME_S)
    check_lengths(
        joint_count,
        positions=state.positions,
        velocities=state.velocities,
        torques=state.torques,
        saturated=state.saturated,
    )
    if state.truth:
        _check_point("truth", state.truth, joint_count)


def _check_command(command: m.Command, joint_count: int) -> None:
    _check_tick(command)
    check_lengths(
        joint_count,
        accelerations=command.accelerations,
        positions=command.positions,
        velocities=command.velocities,
    )


def _check_status(status: m.Status, joint_count: int) -> None:
    _check_range("time", status.time, MAX_TIME_S)
    _check_point("error", status.error, joint_count)


def _check_result(result: m.Result, joint_count: int) -> None:
    for name in m.Stamps.__struct_fields__:
        _check_range(f"stamps.{name}", getattr(result.stamps, name) or 0, MAX_NS)
    if result.hit:
        _check_range("hit.time", result.hit.time, MAX_TIME_S)
        errors = {"hit.position_error": result.hit.position_error, "hit.velocity_error": result.hit.velocity_error}
        check_lengths(joint_count, **errors)
    _check_range("saturated_ticks", result.saturated_ticks, MAX_TICK)
    if result.first_contact:
        _check_range("first_contact.time", result.first_contact.time, MAX_TIME_S)


def _check_refused(refused: m.Refused, _: int) -> None:
    _check_range("requested", refused.requested, MAX_NS)


def _check_disturbance(disturbance: m.Disturbance, joint_count: int) -> None:
    _check_range("time", disturbance.time, MAX_TIME_S)
    for active in disturbance.active:
        if active.values is not None:
            check_lengths(joint_count, **{"active.values": active.values})


def _check_ball(ball: m.BallState, _: int) -> None:
    _check_range("time", ball.time, MAX_TIME_S)
    _check_in_space("position", ball.position)
    if ball.velocity is not None:
        _check_in_space("velocity", ball.velocity)


def _check_scene(scene: m.Scene, _: int) -> None:
    _check_range("time", scene.time, MAX_TIME_S)
    for name, coordinates in scene.joints.items():
        if max(map(abs, coordinates), default=0.0) > MAX_IN_SPACE:
            raise bad_message("joints", f"joints: {name} is at {coordinates}; at most {MAX_IN_SPACE:g} can be shown")


def _check_strike(strike: m.Strike, _: int) -> None:
    _check_range("time", strike.time, MAX_TIME_S)
    _check_range("revisions", strike.revisions, MAX_TICK)
    shown = {"prediction": strike.prediction, "racket": strike.racket, "hit": strike.hit, "landing": strike.landing}
    for name, part in shown.items():
        for field in ("position", "velocity"):
            vector = getattr(part, field, None)
            if vector is not None:
                _check_in_space(f"{name}.{field}", list(vector))
    for place in strike.prediction.path if strike.prediction else ():
        _check_in_space("prediction.path", list(place))


def _check_contact(contact: m.Contact, _: int) -> None:
    _check_range("time", contact.time, MAX_TIME_S)
    if contact.ball_velocity is not None:
        _check_in_space("ball_velocity", contact.ball_velocity)


def _check_plan(plan: m.Plan, joint_count: int) -> None:
    """Refuse a plan whose matrices, limits or waypoints do not fit each other."""
    _check_range("start_time", plan.start_time, MAX_TIME_S)
    _check_range("epoch", plan.epoch, MAX_NS)
    _check_range("phase", plan.phase, 1.0)
    limits = {f"limits.{field}": getattr(plan.limits, field) for field in m.PlanLimits.__struct_fields__}
    check_lengths(joint_count, joint_names=plan.joint_names, **limits)
    if not 0 <= plan.hit_index < plan.count or not MIN_DT_S <= plan.dt < MAX_TIME_S:
        raise bad_message("count", f"count {plan.count}, hit_index {plan.hit_index}, dt {plan.dt} are no trajectory")
    samples_of(plan)
    if plan.demonstration:
        matrix(plan.demonstration, plan.hit_index + 1, joint_count, "demonstration")
    for waypoint in plan.waypoints:
        if waypoint.positions is not None and len(waypoint.positions) != joint_count:
            raise bad_message("waypoints", f"waypoints: one has {len(waypoint.positions)} positions, not {joint_count}")
        if abs(waypoint.time_from_start) > MAX_TIME_S:
            raise bad_message("waypoints", f"waypoints: time_from_start {waypoint.time_from_start} is no time")


def _check_in_space(field: str, vector: list[float]) -> None:
    if len(vector) != 3:
        raise bad_message(field, f"{field} has {len(vector)} entries; space has 3")
    if max(map(abs, vector)) > MAX_IN_SPACE:
        raise bad_message(field, f"{field} is {vector}; at most {MAX_IN_SPACE:g} can be shown")


def _check_range(field: str, value: float, bound: float) -> None:
    if not 0 <= value < bound:
        raise bad_message(field, f"{field} is {value}; it must be at least 0 and less than {bound:g}")


def _check_point(field: str, point: m.Point, joint_count: int) -> None:
    check_lengths(joint_count, **{f"{field}.positions": point.positions, f"{field}.velocities": point.velocities})


CHECKS: dict[type, Callable[[Any, int], None]] = {
    m.State: _check_state,
    m.Command: _check_command,
    m.Status: _check_status,
    m.Result: _check_result,
    m.Plan: _check_plan,
    m.Refused: _check_refused,
    m.Disturbance: _check_disturbance,
    m.BallState: _check_ball,
    m.Scene: _check_scene,
    m.Contact: _check_contact,
    m.Strike: _check_strike,
}
