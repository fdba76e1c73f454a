"""Writers of the two 1 kHz streams: states and commands."""

from collections import deque

import numpy as np
import rerun as rr

from protocol import messages as m
from services.recorder import entities
from services.recorder.context import Context
from services.recorder.validation import Received
from services.recorder.writer import Rows

POSES_HZ = 100
TRAIL_LENGTH = 15
TRAIL_EVERY = 5  # poses
TRAIL_COLOUR = (245, 158, 66)


class StateWriter:
    """Writes measured curves, the arm's condition, and the poses of the arm's bodies at 100 Hz."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._stride = max(1, round(context.rate_hz / POSES_HZ))
        self._condition = ""
        self._trail = Trail(context, self._stride)

    def write(self, received: list[Received[m.State]]) -> None:
        """Write every state."""
        if not received:
            return
        context, trace = self._context, self._context.trace
        ticks = [context.place(one) for one in received]
        context.state_times.add_batch([one.wall_ns for one in received], ticks)
        states = [one.message for one in received]
        context.measured.update((tick, state.positions) for tick, state in zip(ticks, states, strict=True))
        context.pose = np.array(states[-1].positions)
        rows = context.rows(ticks, received)
        trace.joints(entities.MEASURED_POSITION, context.names, rows, [state.positions for state in states])
        trace.joints(entities.MEASURED_VELOCITY, context.names, rows, [state.velocities for state in states])
        trace.scalars(entities.TORQUES.path, rows, np.array([state.torques for state in states]))
        trace.scalars(entities.SATURATED.path, rows, np.array([state.saturated for state in states]))
        trace.scalars(entities.APPLIED_TICK.path, rows, [state.applied_tick for state in states])
        self._write_truth(ticks, received)
        self._write_condition(ticks, received)
        self._write_poses(ticks, received)

    def _write_truth(self, ticks: list[int], received: list[Received[m.State]]) -> None:
        """Write positions and velocities without sensor noise, if the states have them."""
        known = [(tick, one, one.message.truth) for tick, one in zip(ticks, received, strict=True) if one.message.truth]
        if known:
            rows = self._context.rows([tick for tick, _, _ in known], [one for _, one, _ in known])
            trace = self._context.trace
            trace.scalars(entities.TRUE_POSITION.path, rows, np.array([truth.positions for _, _, truth in known]))
            trace.scalars(entities.TRUE_VELOCITY.path, rows, np.array([truth.velocities for _, _, truth in known]))

    def _write_condition(self, ticks: list[int], received: list[Received[m.State]]) -> None:
        """Write when the arm stops being ready, with the reason, and when it is ready again."""
        context = self._context
        for tick, one in zip(ticks, received, strict=True):
            state = one.message
            # An older robot side publishes only whether it brakes.
            condition = "braking" if state.brake else state.condition
            if condition != self._condition:
                self._condition = condition
                row, ready = context.row(tick, one.wall_ns), condition == "ready"
                context.trace.states(entities.CONDITION_LANE.path, row, [None if ready else condition])
                if not ready:
                    reason = f": {state.reason}" if state.reason else ""
                    context.event(entities.CONTROLLER_EVENT, row, f"the arm is {condition}{reason}", "WARN")

    def _write_poses(self, ticks: list[int], received: list[Received[m.State]]) -> None:
        """Write the pose of every body of the arm, and the tool's trail."""
        context = self._context
        chosen = [k for k, tick in enumerate(ticks) if tick % self._stride == 0]
        if not chosen:
            return
        rows = context.rows([ticks[k] for k in chosen], [received[k] for k in chosen])
        positions = np.array([received[k].message.positions for k in chosen])
        times = np.array([received[k].message.time for k in chosen])
        places, turns, tools = context.scene.body_poses(positions, times)
        for index, body in enumerate(context.scene.arm):
            poses = rr.Transform3D.columns(translation=places[:, index], quaternion=turns[:, index])
            context.trace.send(entities.BODY.at(context.scene.names[body]), rows, poses)
        self._trail.write(rows, tools)


class Trail:
    """Writes the last third of a second of the tool's path, as a fading line; a new run starts a new line."""

    def __init__(self, context: Context, stride: int) -> None:
        self._context = context
        self._stride = stride
        self._run = 0
        self._points: deque[np.ndarray] = deque(maxlen=TRAIL_LENGTH)
        fading = [(*TRAIL_COLOUR, round(255 * (k + 1) / TRAIL_LENGTH)) for k in range(TRAIL_LENGTH)]
        context.trace.static(entities.TRAIL.path, rr.LineStrips3D.from_fields(colors=fading, radii=0.006))

    def write(self, rows: Rows, tools: np.ndarray) -> None:
        """Write the trail that ends at each fifth of the tool's positions (N, 3), m."""
        if self._run != self._context.runs.count:
            self._points.clear()
            self._run = self._context.runs.count
        at, strips = [], []
        for index, tool in enumerate(tools):
            if rows.ticks[index] % (2 * self._stride) == 0:
                self._points.append(tool)
            if rows.ticks[index] % (TRAIL_EVERY * self._stride) == 0:
                known = [*self._points, tool]
                line = np.array([known[0]] * (TRAIL_LENGTH + 1 - len(known)) + known)
                at.append(index)
                strips.extend(np.stack([line[:-1], line[1:]], axis=1))
        if at:
            columns = rr.LineStrips3D.columns(strips=strips).partition([TRAIL_LENGTH] * len(at))
            self._context.trace.send(entities.TRAIL.path, rows.only(at), columns)


class CommandWriter:
    """Writes reference curves, commanded accelerations, the tracking error, and the goal of the reference."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._goal: str | None = None

    def write(self, received: list[Received[m.Command]]) -> None:
        """Write every command."""
        if received:
            self._write(received)
        self._context.forget_old()

    def _write(self, received: list[Received[m.Command]]) -> None:
        context, trace = self._context, self._context.trace
        ticks = [context.place(one) for one in received]
        commands = [one.message for one in received]
        rows = context.rows(ticks, received)
        trace.joints(entities.REFERENCE_POSITION, context.names, rows, [command.positions for command in commands])
        trace.joints(entities.REFERENCE_VELOCITY, context.names, rows, [command.velocities for command in commands])
        trace.joints(entities.COMMANDED, context.names, rows, [command.accelerations for command in commands])
        self._write_error(rows, commands)
        for tick, one in zip(ticks, received, strict=True):
            if one.message.goal_id != self._goal:
                self._goal = one.message.goal_id
                trace.states(entities.GOAL_LANE.path, context.row(tick, one.wall_ns), [self._goal])

    def _write_error(self, rows: Rows, commands: list[m.Command]) -> None:
        """Write measured minus reference, if the answered state is known."""
        measured = self._context.measured
        known = [k for k, tick in enumerate(rows.ticks.tolist()) if tick in measured]
        if known:
            errors = np.array([measured[int(rows.ticks[k])] for k in known]) - [commands[k].positions for k in known]
            at = rows if len(known) == len(rows) else rows.only(known)
            self._context.trace.joints(entities.ERROR, self._context.names, at, errors)
