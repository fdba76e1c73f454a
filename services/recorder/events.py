"""Writers of occasional messages: statuses, results, refusals, contacts, the ball."""

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


class ResultWriter:
    """Writes results of goals. `end` ends the curves of a stopped plan."""

    def __init__(self, context: Context, end: Callable[[str], None]) -> None:
        self._context = context
        self._end = end

    def write(self, received: list[Received[m.Result]]) -> None:
        """Write every result at the arm's present tick, and its errors at the time of the hit."""
        context = self._context
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
                self._end(result.goal_id)


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


class RefusalWriter:
    """Writes refused goals."""

    def __init__(self, context: Context) -> None:
        self._context = context

    def write(self, received: list[Received[m.Refused]]) -> None:
        """Write every refusal at the arm's present tick."""
        for one in received:
            refused, row = one.message, self._context.row_at(one.wall_ns)
            goal = f"goal {refused.goal_id}" if refused.goal_id else "a goal"
            sentence = f"{goal} refused as {refused.code}: {refused.message}"
            self._context.event(entities.GOAL_EVENT, row, sentence, "WARN")
            self._context.trace.values(
                entities.REFUSALS.path,
                row,
                goal_id=[refused.goal_id or ""],
                client_id=[refused.client_id],
                primitive=[refused.primitive],
                code=[refused.code],
                requested=[refused.requested],
            )


class ContactWriter:
    """Writes contacts of two bodies."""

    def __init__(self, context: Context) -> None:
        self._context = context

    def write(self, received: list[Received[m.Contact]]) -> None:
        """Write every contact: the touch and the impulse at its time, the end at the arm's present tick."""
        for one in received:
            contact = one.message
            row = self._context.row(self._context.runs.tick_at(contact.time), one.wall_ns)
            bodies, ball = " and ".join(contact.bodies), contact.ball_velocity
            if not contact.ended:
                self._context.event(entities.CONTACT_EVENT, row, f"{bodies} touch")
                continue
            speed = "" if ball is None else f", the ball leaves at {np.linalg.norm(ball):.2f} m/s"
            sentence = f"{bodies} parted after {contact.impulse:.3f} N·s{speed}"
            self._context.event(entities.CONTACT_EVENT, self._context.row_at(one.wall_ns), sentence)
            self._context.trace.scalars(entities.CONTACTS.path, row, [contact.impulse])


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
