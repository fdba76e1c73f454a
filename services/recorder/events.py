"""Writers of occasional messages: statuses, results, refusals, contacts, the ball, other moving bodies."""

import time
from collections.abc import Callable

import numpy as np
import rerun as rr

from protocol import messages as m
from robot.court import BALL, TEE
from services.recorder import entities
from services.recorder.context import Context
from services.recorder.validation import Received
from services.recorder.writer import Rows

AT_REST_M_S = 0.05


class StatusWriter:
    """Writes the timing of the controller's loop, and its changes of mode."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._mode: str | None = None
        self._fault: str | None = None
        self._refused = 0
        self._missed = 0

    def write(self, received: list[Received[m.Status]]) -> None:
        """Write every status."""
        if not received:
            return
        context, trace = self._context, self._context.trace
        ticks = [context.runs.tick_at(one.message.time) for one in received]
        statuses = [one.message for one in received]
        rows = context.rows(ticks, received)
        cycles = [status.cycle for status in statuses]
        late = np.array([(c.late_us.p50, c.late_us.p99, c.late_us.max) for c in cycles])
        trace.scalars(entities.LATE.path, rows, late)
        for field, entity in entities.LOOP.items():
            trace.scalars(entity.path, rows, [getattr(cycle, field) for cycle in cycles])
        trace.scalars(entities.POSITION_ERROR.path, rows, np.array([s.error.positions for s in statuses]))
        trace.scalars(entities.VELOCITY_ERROR.path, rows, np.array([s.error.velocities for s in statuses]))
        for tick, one in zip(ticks, received, strict=True):
            self._write_changes(context.row(tick, one.wall_ns), one.message)

    def _write_changes(self, row: Rows, status: m.Status) -> None:
        if status.mode != self._mode:
            self._context.trace.states(entities.MODE_LANE.path, row, [status.mode])
            self._event(row, f"mode {status.mode}" + (f", was {self._mode}" if self._mode else ""))
        if status.fault and status.fault != self._fault:
            self._event(row, f"fault: {status.fault}", "ERROR")
        if (refused := status.cycle.refused - self._refused) > 0:
            self._event(row, f"refused {refused} malformed message(s)", "WARN")
        if (missed := status.cycle.missed - self._missed) > 0:
            self._event(row, f"late: {missed} tick(s) without an answer in time", "WARN")
        self._mode, self._fault = status.mode, status.fault
        self._refused, self._missed = status.cycle.refused, status.cycle.missed

    def _event(self, row: Rows, sentence: str, level: str = "INFO") -> None:
        self._context.event(entities.CONTROLLER_EVENT, row, sentence, level)


def write_results(context: Context, end: Callable[[str], None], received: list[Received[m.Result]]) -> None:
    """Write results of goals at the arm's present tick, and their errors at the time of the hit.

    `end` ends the curves of a stopped plan.
    """
    for one in received:
        result, row = one.message, context.row_at(one.wall_ns)
        good = result.outcome in ("succeeded", "preempted")
        context.event(entities.GOAL_EVENT, row, _sentence(result), "INFO" if good else "WARN")
        context.trace.values(
            entities.GOALS.path,
            row,
            goal_id=[result.goal_id],
            outcome=[result.outcome],
            reason=[result.reason],
            peak_tracking_error=[float(result.peak_tracking_error)],
            saturated_ticks=[result.saturated_ticks],
            first_contact=[_touch(result.first_contact)],
            **{name: [int(getattr(result.stamps, name) or 0)] for name in m.Stamps.__struct_fields__},
        )
        if hit := result.hit:
            at = context.row(context.runs.tick_at(hit.time), one.wall_ns)
            context.trace.scalars(entities.HIT_POSITION_ERROR.path, at, np.array([hit.position_error]))
            context.trace.scalars(entities.HIT_VELOCITY_ERROR.path, at, np.array([hit.velocity_error]))
        if result.outcome in ("canceled", "aborted"):
            end(result.goal_id)


def _touch(contact: m.FirstContact | None) -> str:
    """Return a contact in words; empty: none."""
    return f"{contact.body} touched {contact.other} at {contact.time:.3f} s" if contact else ""


def _sentence(result: m.Result) -> str:
    reason = f" ({result.reason})" if result.reason else ""
    hit = ""
    if result.hit:
        position = max((abs(error) for error in result.hit.position_error), default=0.0)
        velocity = max((abs(error) for error in result.hit.velocity_error), default=0.0)
        hit = f"; off by {position:.2g} rad and {velocity:.2g} rad/s at the hit"
    touch = f"; {_touch(result.first_contact)}" if result.first_contact else ""
    peak = f"; peak error {result.peak_tracking_error:.2g} rad"
    recoil = f"; recoil {result.recoil.peak_error:.2g} rad" if result.recoil else ""
    return f"goal {result.goal_id} {result.outcome}{reason}{hit}{peak}{touch}{recoil}"


def write_refusals(context: Context, received: list[Received[m.Refused]]) -> None:
    """Write refused goals at the arm's present tick."""
    for one in received:
        refused, row = one.message, context.row_at(one.wall_ns)
        goal = f"goal {refused.goal_id}" if refused.goal_id else "a goal"
        context.event(entities.GOAL_EVENT, row, f"{goal} refused as {refused.code}: {refused.message}", "WARN")
        context.trace.values(
            entities.REFUSALS.path,
            row,
            goal_id=[refused.goal_id or ""],
            client_id=[refused.client_id],
            primitive=[refused.primitive],
            code=[refused.code],
            requested=[refused.requested],
        )


def write_contacts(context: Context, received: list[Received[m.Contact]]) -> None:
    """Write contacts of two bodies: the touch and the impulse at its time, the end at the arm's present tick."""
    for one in received:
        contact = one.message
        row = context.row(context.runs.tick_at(contact.time), one.wall_ns)
        bodies, ball = " and ".join(contact.bodies), contact.ball_velocity
        if not contact.ended:
            context.event(entities.CONTACT_EVENT, row, f"{bodies} touch")
            continue
        speed = "" if ball is None else f", the ball leaves at {np.linalg.norm(ball):.2f} m/s"
        sentence = f"{bodies} parted after {contact.impulse:.3f} N·s{speed}"
        context.event(entities.CONTACT_EVENT, context.row_at(one.wall_ns), sentence)
        context.trace.scalars(entities.CONTACTS.path, row, [contact.impulse])


class BallWriter:
    """Writes the ball, and the tee below its first position at rest."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._run = -1

    def write(self, received: list[Received[m.BallState]]) -> None:
        """Write every state of the ball."""
        if not received:
            return
        context, trace = self._context, self._context.trace
        rows = context.rows([context.runs.tick_at(one.message.time) for one in received], received)
        positions = np.array([one.message.position for one in received])
        velocities = np.array([(one.message.truth or one.message).velocity or [np.nan] * 3 for one in received])
        trace.scalars(entities.BALL_POSITION.path, rows, positions)
        trace.scalars(entities.BALL_VELOCITY.path, rows, velocities)
        trace.send(entities.BALL_BODY.path, rows, rr.Transform3D.columns(translation=positions))
        if self._run < 0:
            context.scene.write_body(trace, BALL)
            context.scene.write_body(trace, TEE)
        if self._run != context.runs.count:
            self._run = context.runs.count
            if np.linalg.norm(velocities[0]) < AT_REST_M_S:
                top = positions[:1] - [0.0, 0.0, context.scene.radius_of(BALL)]
                trace.send(entities.TEE.path, rows.only([0]), rr.Transform3D.columns(translation=top))


class SurroundingsWriter:
    """Writes the poses of bodies that only joints other than the arm's move."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._begun = False

    def write(self, received: list[Received[m.Scene]]) -> None:
        """Write every message, and at the first state the model's poses."""
        context = self._context
        if not context.scene.others:
            return
        if not self._begun and context.runs.count:
            self._begun = True
            self._write(context.row(0, time.time_ns()), [context.scene.other_poses({})])
        if received:
            rows = context.rows([context.runs.tick_at(one.message.time) for one in received], received)
            self._write(rows, [context.scene.other_poses(one.message.joints) for one in received])

    def _write(self, rows: Rows, poses: list[tuple[np.ndarray, np.ndarray]]) -> None:
        for index, body in enumerate(self._context.scene.others):
            columns = rr.Transform3D.columns(
                translation=[places[index] for places, _ in poses], quaternion=[turns[index] for _, turns in poses]
            )
            self._context.trace.send(entities.BODY.at(self._context.scene.names[body]), rows, columns)
