"""Accepted plans: their curves beside the measured ones, their limits, and the racket's path in space."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr

from protocol import messages as m
from protocol.codec import matrix
from services.recorder.context import Canvas
from services.recorder.validation import Received
from services.recorder.writer import Rows

PATH_EVERY_S = 0.01
HEARTBEAT_S = 1.0
PLANNED, DEMONSTRATED, HIT = (110, 190, 110), (150, 150, 160), (235, 64, 52)
QUANTITIES = {"position": "positions", "velocity": "velocities", "acceleration": "accelerations"}

Limits = dict[str, np.ndarray]
"""Per quantity (J, 2): lowest and highest, NaN where there is none."""


@dataclass(slots=True, eq=False)
class Track:
    """A plan on its way into the trace: written up to `written` of the rows at laid `ticks`, never from `end` on.

    `corrects`: it goes on with the motion of another goal, whose curves end one tick before so that a gap parts both.
    """

    goal_id: str
    corrects: bool
    ticks: np.ndarray
    curves: Limits
    demonstration: np.ndarray
    target_ticks: np.ndarray
    targets: np.ndarray
    limits: Limits
    end: int
    written: int = -1


class PlanDrawer:
    """Draws each plan's path at once, and its curves as time passes over them."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._tracks: list[Track] = []
        self._given_up: deque[str] = deque(maxlen=64)
        self._robot_limits = _robot_limits(canvas)
        self._limits: Limits | None = None
        self._limits_tick = -1
        trace = canvas.trace
        trace.static("/world/plan/path", rr.LineStrips3D.from_fields(colors=PLANNED, radii=0.004))
        trace.static("/world/plan/demonstration", rr.LineStrips3D.from_fields(colors=DEMONSTRATED, radii=0.002))
        trace.static("/world/plan/hit", rr.Points3D.from_fields(colors=HIT, radii=0.02, labels=["hit"]))

    def draw(self, received: list[Received[m.Plan]]) -> None:
        """Take new plans in, and write all curves up to now."""
        canvas = self._canvas
        for track in self._tracks:  # a new run ends what was planned in the one before
            if track.ticks[0] < canvas.lives.offset:
                track.end = min(track.end, canvas.lives.offset)
        for one in received:
            track = self._track(one.message)
            self._splice(track)
            self._announce(one, track)
            if track.goal_id in self._given_up:
                self._given_up.remove(track.goal_id)
                self.cut(track.goal_id)
        if canvas.lives.newest >= 0:
            self._advance(canvas.lives.newest)

    def _splice(self, track: Track) -> None:
        """End the curves of all plans before where those of `track` begin."""
        first = int(track.ticks[0])
        gap = first - 1 if track.corrects else first
        for before in self._tracks:
            before.end = min(before.end, gap)
        if track.corrects:
            self._lift_pen(gap)
            self._mark(track)
        self._tracks.append(track)

    def _mark(self, track: Track) -> None:
        """A point on every joint's curve where a correction takes over."""
        canvas, row = self._canvas, Rows(track.ticks[:1], self._canvas.rate_hz)
        canvas.trace.joints("/joints/{}/position/corrected", canvas.names, row, track.curves["position"][:1])

    def cut(self, goal_id: str) -> None:
        """Write no more of a plan that was given up, even where word of it comes later."""
        given_up = [track for track in self._tracks if track.goal_id == goal_id]
        for track in given_up:
            track.end = min(track.end, self._canvas.lives.newest + 1)
        if not given_up:
            self._given_up.append(goal_id)

    def _track(self, plan: m.Plan) -> Track:
        canvas, joints = self._canvas, len(self._canvas.names)
        curves = {q: matrix(getattr(plan, field), plan.count, joints, field) for q, field in QUANTITIES.items()}
        samples = plan.hit_index + 1 if plan.demonstration else 0
        demonstration = matrix(plan.demonstration, samples, joints, "demonstration")
        first = canvas.lives.lay_ahead(plan.start_time)
        ticks = first + np.rint(np.arange(plan.count) * plan.dt * canvas.rate_hz).astype(np.int64)
        points = [(w.time_from_start, w.positions) for w in plan.waypoints if w.positions is not None]
        points.append((plan.hit_index * plan.dt, curves["position"][plan.hit_index].tolist()))
        return Track(
            goal_id=plan.goal_id,
            corrects=plan.revises is not None,
            ticks=ticks,
            curves=curves,
            demonstration=demonstration,
            target_ticks=first + np.rint([time * canvas.rate_hz for time, _ in points]).astype(np.int64),
            targets=np.array([values for _, values in points], dtype=float),  # a free joint's null becomes NaN
            limits={q: _limit_rows(getattr(plan.limits, field)) for q, field in QUANTITIES.items()},
            end=int(ticks[-1]) + 1,
        )

    def _announce(self, one: Received[m.Plan], track: Track) -> None:
        """The event, and the paths of the racket in space."""
        canvas, plan, row = self._canvas, one.message, self._canvas.now(one.wall_ns)
        through = f", through {len(plan.waypoints)} waypoint(s)" if plan.waypoints else ""
        corrects = f", corrects {plan.revises} at phase {plan.phase:.3f}" if plan.revises is not None else ""
        sentence = (
            f"plan {plan.goal_id} ({plan.primitive}) accepted{corrects}: starts at {plan.start_time:.3f} s of its run, "
            f"hits {plan.hit_index * plan.dt:.3f} s later, at rest after {(plan.count - 1) * plan.dt:.3f} s{through}"
        )
        canvas.event("goal", row, sentence)
        values = {"goal_id": [plan.goal_id], "primitive": [plan.primitive], "epoch": [plan.epoch]}
        values |= {"revises": [plan.revises or ""], "phase": [float(plan.phase)]}
        canvas.trace.values("/plans", row, **values, start_time=[plan.start_time])
        stride = max(1, round(PATH_EVERY_S / plan.dt))
        positions = track.curves["position"]
        strip = canvas.scene.tool_path(positions[::stride])
        canvas.trace.send("/world/plan/path", row, rr.LineStrips3D.columns(strips=[strip]))
        hit = canvas.scene.tool_path(positions[plan.hit_index : plan.hit_index + 1])
        canvas.trace.send("/world/plan/hit", row, rr.Points3D.columns(positions=hit))
        shown = canvas.scene.tool_path(track.demonstration[::stride])
        canvas.trace.send("/world/plan/demonstration", row, rr.LineStrips3D.columns(strips=[shown]))

    def _advance(self, newest: int) -> None:
        """Write what lies between the last call and `newest`, of the limits too."""
        for track in self._tracks:
            if track.written < 0 and track.ticks[0] <= min(newest, track.end - 1):
                self._show_limits(track.limits, int(track.ticks[0]))
            self._write(track, min(newest, track.end - 1))
        over = [track for track in self._tracks if track.end <= newest]
        self._tracks = [track for track in self._tracks if track.end > newest]
        if over and not any(track.ticks[0] <= newest for track in self._tracks):
            self._lift_pen(over[-1].end)
            self._show_limits(self._robot_limits, over[-1].end)
        if self._limits is None:
            self._show_limits(self._robot_limits, self._canvas.heard[1][0] if self._canvas.heard[1] else newest)
        elif newest - self._limits_tick >= HEARTBEAT_S * self._canvas.rate_hz:
            self._show_limits(self._limits, newest)

    def _write(self, track: Track, until: int) -> None:
        """Write the rows of a track at ticks up to `until`."""
        chosen = np.flatnonzero((track.ticks > track.written) & (track.ticks <= until))
        canvas, trace = self._canvas, self._canvas.trace
        if not len(chosen):
            return
        rows = Rows(track.ticks[chosen], canvas.rate_hz)
        for quantity, values in track.curves.items():
            trace.joints(f"/joints/{{}}/{quantity}/planned", canvas.names, rows, values[chosen])
        shown = chosen[chosen < len(track.demonstration)]
        if len(shown):
            at = Rows(track.ticks[shown], canvas.rate_hz)
            trace.joints("/joints/{}/position/demonstrated", canvas.names, at, track.demonstration[shown])
        self._write_targets(track, until)
        track.written = until

    def _write_targets(self, track: Track, until: int) -> None:
        canvas = self._canvas
        for tick, values in zip(track.target_ticks.tolist(), track.targets, strict=True):
            if track.written < tick <= until:
                for name, value in zip(canvas.names, values.tolist(), strict=True):
                    if np.isfinite(value):
                        row = Rows([tick], canvas.rate_hz)
                        canvas.trace.scalars(f"/joints/{name}/position/target", row, [value])

    def _lift_pen(self, tick: int) -> None:
        """End the curves, so that no line joins them to the next plan's."""
        row = Rows([tick], self._canvas.rate_hz)
        curves = [f"{quantity}/planned" for quantity in QUANTITIES]
        for name in self._canvas.names:
            for curve in (*curves, "position/demonstrated"):
                self._canvas.trace.send(f"/joints/{name}/{curve}", row, rr.Scalars.columns(scalars=[]).partition([0]))

    def _show_limits(self, limits: Limits, tick: int) -> None:
        self._limits, self._limits_tick = limits, tick
        row = Rows([tick], self._canvas.rate_hz)
        for quantity, bounds in limits.items():
            for name, pair in zip(self._canvas.names, bounds, strict=True):
                if np.isfinite(pair).all():
                    self._canvas.trace.scalars(f"/joints/{name}/{quantity}/limits", row, pair[None])


def _limit_rows(bounds: Sequence[m.Range | float | None]) -> np.ndarray:
    """(J, 2) from what a plan says: pairs, symmetric bounds or nothing."""
    rows = []
    for bound in bounds:
        if bound is None:
            rows.append((np.nan, np.nan))
        else:
            rows.append((-bound, bound) if isinstance(bound, int | float) else tuple(bound))
    return np.array(rows, dtype=float)


def _robot_limits(canvas: Canvas) -> Limits:
    """The robot's own limits, in force between plans."""
    limits = canvas.config.limits
    return {
        "position": np.asarray(limits.positions, dtype=float),
        "velocity": np.stack([-limits.velocities, limits.velocities], axis=1),
        "acceleration": np.stack([-limits.accelerations, limits.accelerations], axis=1),
    }
