"""What happens now and then: modes and faults, results and refusals, contacts, the ball, disturbances."""

from collections.abc import Callable

import numpy as np
import rerun as rr

from protocol import messages as m
from services.recorder.context import Canvas
from services.recorder.scene import BALL, TEE, path_of
from services.recorder.validation import Received
from services.recorder.writer import Rows

AT_REST_M_S = 0.05
PUSH_COLOUR = (220, 38, 127)
PUSH_KINDS = ("acceleration", "torque")
ARROW_M = (0.15, 0.45)
"""Length of a push's arrow: that of none, and what one at the joint's limit adds."""


class StatusDrawer:
    """The controller's loop timing, and its changes of mode."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._mode: str | None = None
        self._fault: str | None = None
        self._refused = 0
        self._missed = 0

    def draw(self, received: list[Received[m.Status]]) -> None:
        """Write every status."""
        if not received:
            return
        canvas, trace = self._canvas, self._canvas.trace
        ticks = [canvas.lives.lay_time(one.message.time) for one in received]
        statuses = [one.message for one in received]
        rows = canvas.rows(ticks, received)
        cycles = [status.cycle for status in statuses]
        late = np.array([(c.late_us.p50, c.late_us.p99, c.late_us.max) for c in cycles])
        trace.scalars("/timing/late_us", rows, late)
        for field in ("on_time_ratio", "missed", "count", "refused"):
            trace.scalars(f"/timing/{field}", rows, [getattr(cycle, field) for cycle in cycles])
        trace.scalars("/timing/error/position", rows, np.array([s.error.positions for s in statuses]))
        trace.scalars("/timing/error/velocity", rows, np.array([s.error.velocities for s in statuses]))
        for tick, one in zip(ticks, received, strict=True):
            self._draw_changes(canvas.row(tick, one.wall_ns), one.message)

    def _draw_changes(self, row: Rows, status: m.Status) -> None:
        canvas = self._canvas
        if status.mode != self._mode:
            canvas.trace.states("/lanes/mode", row, [status.mode])
            canvas.event("controller", row, f"mode {status.mode}" + (f", was {self._mode}" if self._mode else ""))
            self._mode = status.mode
        if status.fault != self._fault:
            if status.fault:
                canvas.event("controller", row, f"fault: {status.fault}", "ERROR")
            self._fault = status.fault
        if status.cycle.refused > self._refused:
            more = status.cycle.refused - self._refused
            canvas.event("controller", row, f"refused {more} malformed message(s)", "WARN")
        self._refused = status.cycle.refused
        if status.cycle.missed > self._missed:
            more = status.cycle.missed - self._missed
            canvas.event("controller", row, f"late: {more} tick(s) without an answer in time", "WARN")
        self._missed = status.cycle.missed


class EndedDrawer:
    """How goals went. `cut` ends the curves of a plan that was given up."""

    def __init__(self, canvas: Canvas, cut: Callable[[str], None]) -> None:
        self._canvas = canvas
        self._cut = cut

    def draw(self, received: list[Received[m.Result]]) -> None:
        """Write every result where the arm is now, its errors at the time of the hit."""
        for one in received:
            result, row = one.message, self._canvas.now(one.wall_ns)
            good = result.outcome in ("succeeded", "preempted")
            self._canvas.event("goal", row, _sentence(result), "INFO" if good else "WARN")
            stamps = result.stamps
            self._canvas.trace.values(
                "/goals",
                row,
                goal_id=[result.goal_id],
                outcome=[result.outcome],
                reason=[result.reason],
                peak_tracking_error=[float(result.peak_tracking_error)],
                **{name: [int(getattr(stamps, name) or 0)] for name in m.Stamps.__struct_fields__},
            )
            if result.hit:
                at = self._canvas.row(self._canvas.lives.lay_time(result.hit.time), one.wall_ns)
                self._canvas.trace.scalars("/goals/position_error", at, np.array([result.hit.position_error]))
                self._canvas.trace.scalars("/goals/velocity_error", at, np.array([result.hit.velocity_error]))
            if result.outcome in ("canceled", "aborted"):
                self._cut(result.goal_id)


def _sentence(result: m.Result) -> str:
    reason = f" ({result.reason})" if result.reason else ""
    hit = ""
    if result.hit:
        position = max((abs(error) for error in result.hit.position_error), default=0.0)
        velocity = max((abs(error) for error in result.hit.velocity_error), default=0.0)
        hit = f"; off by {position:.2g} rad and {velocity:.2g} rad/s at the hit"
    return f"goal {result.goal_id} {result.outcome}{reason}{hit}; peak error {result.peak_tracking_error:.2g} rad"


class RefusedDrawer:
    """Goals that were refused."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas

    def draw(self, received: list[Received[m.Refused]]) -> None:
        """Write every refusal where the arm is now."""
        for one in received:
            refused, row = one.message, self._canvas.now(one.wall_ns)
            goal = f"goal {refused.goal_id}" if refused.goal_id else "a goal"
            self._canvas.event("goal", row, f"{goal} refused as {refused.code}: {refused.message}", "WARN")
            self._canvas.trace.values(
                "/goals/refused",
                row,
                goal_id=[refused.goal_id or ""],
                client_id=[refused.client_id],
                primitive=[refused.primitive],
                code=[refused.code],
                requested=[refused.requested],
            )


class ContactDrawer:
    """Who touched whom, and how hard."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas

    def draw(self, received: list[Received[m.Contact]]) -> None:
        """Write every contact at its first touch."""
        for one in received:
            contact = one.message
            row = self._canvas.row(self._canvas.lives.lay_time(contact.time), one.wall_ns)
            speed = ""
            if contact.ball_velocity is not None:
                speed = f", the ball leaves at {np.linalg.norm(contact.ball_velocity):.2f} m/s"
            bodies = " and ".join(contact.bodies)
            self._canvas.event("contact", row, f"{bodies} touched with {contact.impulse:.3f} N·s{speed}")
            self._canvas.trace.scalars("/contacts", row, [contact.impulse])


class BallDrawer:
    """Where the ball is, and the tee below where it first rests."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._lives_seen = -1
        canvas.scene.draw_body(canvas.trace, BALL)

    def draw(self, received: list[Received[m.BallState]]) -> None:
        """Write every place of the ball."""
        if not received:
            return
        canvas, trace = self._canvas, self._canvas.trace
        rows = canvas.rows([canvas.lives.lay_time(one.message.time) for one in received], received)
        places = np.array([one.message.position for one in received])
        velocities = np.array([one.message.velocity for one in received])
        trace.scalars("/ball/position", rows, places)
        trace.scalars("/ball/velocity", rows, velocities)
        trace.send(path_of(BALL), rows, rr.Transform3D.columns(translation=places))
        if self._lives_seen != canvas.begun:
            if self._lives_seen < 0:
                canvas.scene.draw_body(trace, TEE)
            self._lives_seen = canvas.begun
            top = places[:1] - [0.0, 0.0, canvas.scene.radius_of(BALL)]
            if np.linalg.norm(velocities[0]) < AT_REST_M_S:
                trace.send(path_of(TEE), rows.only([0]), rr.Transform3D.columns(translation=top))


class DisturbanceDrawer:
    """What disturbs the arm: steps in the joints' plots, a lane, events, and arrows on the links."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._pushes = {kind: np.zeros(len(canvas.names)) for kind in PUSH_KINDS}
        self._arrows: set[str] = set()
        self._tick = -1

    def draw(self, received: list[Received[m.Disturbance]]) -> None:
        """Write every change."""
        for one in received:
            tick = self._canvas.lives.lay_time(one.message.time)
            row = self._canvas.row(tick, one.wall_ns)
            kinds = list(dict.fromkeys(_describe(active) for active in one.message.active))
            lane = " + ".join(dict.fromkeys(active.kind for active in one.message.active))
            self._canvas.trace.states("/lanes/disturbance", row, [lane or None])
            self._canvas.event("disturbance", row, " and ".join(kinds) if kinds else "no disturbance any more")
            self._draw_steps(tick, one)
            self._draw_arrows(row)

    def _draw_steps(self, tick: int, one: Received[m.Disturbance]) -> None:
        """The pushes summed, and once more their old values just before, so that the step is upright."""
        canvas = self._canvas
        pushes = {kind: np.zeros(len(canvas.names)) for kind in PUSH_KINDS}
        for active in one.message.active:
            if active.kind in pushes and active.values is not None:
                pushes[active.kind] += active.values
        for kind, values in pushes.items():
            steps = [(tick, values)]
            if tick - 1 > self._tick:
                steps.insert(0, (tick - 1, self._pushes[kind]))
            rows = canvas.rows([at for at, _ in steps], [one] * len(steps))
            path = f"/joints/{{}}/disturbance/{kind}"
            canvas.trace.joints(path, canvas.names, rows, [list(step) for _, step in steps])
        self._pushes, self._tick = pushes, tick

    def _draw_arrows(self, row: Rows) -> None:
        """An arrow on each pushed link, along the way the push moves the racket."""
        canvas, config = self._canvas, self._canvas.config
        strength = self._pushes["acceleration"] / config.limits.accelerations + self._pushes["torque"] / config.torques
        shown = set()
        for joint in np.flatnonzero(strength):
            body, origin, direction = canvas.scene.push_arrow(int(joint), canvas.pose)
            length = np.sign(strength[joint]) * (ARROW_M[0] + ARROW_M[1] * min(1.0, abs(strength[joint])))
            arrow = rr.Arrows3D.columns(
                vectors=[length * direction], origins=[origin], colors=[PUSH_COLOUR], radii=[0.012]
            )
            canvas.trace.send(f"{path_of(body)}/push", row, arrow)
            shown.add(body)
        for body in self._arrows - shown:
            canvas.trace.send(f"{path_of(body)}/push", row, rr.Arrows3D.columns(vectors=[]).partition([0]))
        self._arrows = shown


def _describe(active: m.ActiveDisturbance) -> str:
    if active.kind == "sensor_noise":
        return f"sensor noise of {active.position_std or 0:.3g} rad and {active.velocity_std or 0:.3g} rad/s"
    if active.kind == "loss":
        return f"loss of {active.stream}"
    if active.values is None:
        return active.kind
    unit = {"acceleration": " rad/s²", "torque": " N·m"}.get(active.kind, "")
    return f"{active.kind} push [{', '.join(f'{value:g}' for value in active.values)}]{unit}"
