"""The two 1 kHz streams: what the arm measures and what it is told."""

from collections import deque

import numpy as np
import rerun as rr

from protocol import messages as m
from services.recorder.context import Canvas
from services.recorder.scene import path_of
from services.recorder.validation import Received
from services.recorder.writer import Rows

POSES_HZ = 100
TRAIL_LENGTH = 15
TRAIL_EVERY = 5  # poses
TRAIL_COLOUR = (245, 158, 66)


class StateDrawer:
    """Measured curves, and the arm's poses and the racket's trail at 100 Hz."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._stride = max(1, round(canvas.rate_hz / POSES_HZ))
        self._brake: bool | None = None
        self._trail: deque[np.ndarray] = deque(maxlen=TRAIL_LENGTH)
        self._lives_seen = 0
        fading = [(*TRAIL_COLOUR, round(255 * (k + 1) / TRAIL_LENGTH)) for k in range(TRAIL_LENGTH)]
        canvas.trace.static("/world/trail", rr.LineStrips3D.from_fields(colors=fading, radii=0.006))

    def draw(self, received: list[Received[m.State]]) -> None:
        """Write every state."""
        if not received:
            return
        canvas, trace = self._canvas, self._canvas.trace
        ticks = [canvas.lay_state(one) for one in received]
        canvas.hear(received, ticks)
        states = [one.message for one in received]
        for tick, state in zip(ticks, states, strict=True):
            canvas.remember(tick, state.positions)
        canvas.pose = np.array(states[-1].positions)
        rows = canvas.rows(ticks, received)
        trace.joints("/joints/{}/position/measured", canvas.names, rows, [s.positions for s in states])
        trace.joints("/joints/{}/velocity/measured", canvas.names, rows, [s.velocities for s in states])
        trace.scalars("/arm/torques", rows, np.array([s.torques for s in states]))
        trace.scalars("/arm/saturated", rows, np.array([s.saturated for s in states]))
        trace.scalars("/arm/applied_tick", rows, [s.applied_tick for s in states])
        self._draw_truth(ticks, received)
        self._draw_brake(ticks, received)
        self._draw_poses(ticks, received)

    def _draw_truth(self, ticks: list[int], received: list[Received[m.State]]) -> None:
        """What no sensor noise has touched, where the arm knows it."""
        known = [(tick, one, one.message.truth) for tick, one in zip(ticks, received, strict=True) if one.message.truth]
        if known:
            rows = self._canvas.rows([tick for tick, _, _ in known], [one for _, one, _ in known])
            trace = self._canvas.trace
            trace.scalars("/arm/true_position", rows, np.array([truth.positions for _, _, truth in known]))
            trace.scalars("/arm/true_velocity", rows, np.array([truth.velocities for _, _, truth in known]))

    def _draw_brake(self, ticks: list[int], received: list[Received[m.State]]) -> None:
        for tick, one in zip(ticks, received, strict=True):
            if one.message.brake != self._brake:
                row = self._canvas.row(tick, one.wall_ns)
                self._canvas.trace.states("/lanes/brake", row, ["braking" if one.message.brake else None])
                if one.message.brake:
                    self._canvas.event("controller", row, "the arm brakes: it hears no commands", "WARN")
                self._brake = one.message.brake

    def _draw_poses(self, ticks: list[int], received: list[Received[m.State]]) -> None:
        """Every body's pose, and the trail behind the racket."""
        canvas = self._canvas
        chosen = [k for k, tick in enumerate(ticks) if tick % self._stride == 0]
        if not chosen:
            return
        rows = canvas.rows([ticks[k] for k in chosen], [received[k] for k in chosen])
        places, turns, tools = canvas.scene.body_poses(np.array([received[k].message.positions for k in chosen]))
        for index, body in enumerate(canvas.scene.arm):
            poses = rr.Transform3D.columns(translation=places[:, index], quaternion=turns[:, index])
            canvas.trace.send(path_of(canvas.scene.body_names[body]), rows, poses)
        self._draw_trail(rows, tools)

    def _draw_trail(self, rows: Rows, tools: np.ndarray) -> None:
        """The racket's last third of a second as a line that fades; a new run starts a new one."""
        canvas = self._canvas
        if self._lives_seen != canvas.begun:
            self._trail.clear()
            self._lives_seen = canvas.begun
        at, strips = [], []
        for index, tool in enumerate(tools):
            if rows.ticks[index] % (2 * self._stride) == 0:
                self._trail.append(tool)
            if rows.ticks[index] % (TRAIL_EVERY * self._stride) == 0:
                known = [*self._trail, tool]
                line = np.array([known[0]] * (TRAIL_LENGTH + 1 - len(known)) + known)
                at.append(index)
                strips.extend(np.stack([line[:-1], line[1:]], axis=1))
        if at:
            columns = rr.LineStrips3D.columns(strips=strips).partition([TRAIL_LENGTH] * len(at))
            canvas.trace.send("/world/trail", rows.only(at), columns)


class CommandDrawer:
    """Reference curves, commanded accelerations, the tracking error, and which goal they serve."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._goal: str | None = None

    def draw(self, received: list[Received[m.Command]]) -> None:
        """Write every command."""
        if received:
            self._draw(received)
        self._canvas.forget()

    def _draw(self, received: list[Received[m.Command]]) -> None:
        canvas, trace = self._canvas, self._canvas.trace
        ticks = [canvas.lay_command(one) for one in received]
        commands = [one.message for one in received]
        rows = canvas.rows(ticks, received)
        trace.joints("/joints/{}/position/reference", canvas.names, rows, [c.positions for c in commands])
        trace.joints("/joints/{}/velocity/reference", canvas.names, rows, [c.velocities for c in commands])
        trace.joints("/joints/{}/acceleration/commanded", canvas.names, rows, [c.accelerations for c in commands])
        self._draw_error(rows, commands)
        for tick, one in zip(ticks, received, strict=True):
            if one.message.goal_id != self._goal:
                self._goal = one.message.goal_id
                trace.states("/lanes/goal", canvas.row(tick, one.wall_ns), [self._goal])

    def _draw_error(self, rows: Rows, commands: list[m.Command]) -> None:
        """Measured less reference, where the state answered is known."""
        measured = self._canvas.measured
        known = [k for k, tick in enumerate(rows.ticks.tolist()) if tick in measured]
        if known:
            errors = np.array([measured[int(rows.ticks[k])] for k in known]) - [commands[k].positions for k in known]
            at = rows if len(known) == len(rows) else rows.only(known)
            self._canvas.trace.joints("/joints/{}/error", self._canvas.names, at, errors)
