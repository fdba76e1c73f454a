"""Writer of disturbances: steps in the joints' plots, a lane, events, and arrows on the links."""

import numpy as np
import rerun as rr

from protocol import messages as m
from services.recorder import entities
from services.recorder.context import Context
from services.recorder.validation import Received
from services.recorder.writer import Rows

COLOUR = (220, 38, 127)
ARROW_M = (0.15, 0.45)
"""Length of a push's arrow, m: of the smallest push, and the addition for a push at the joint's limit."""
RADIUS_M = 0.012
KINDS = {
    "acceleration": ("acceleration push", " rad/s²"),
    "torque": ("torque push", " N·m"),
    "wind": ("wind", " m/s"),
}
"""Disturbances with values: their names in events, and their units."""


class DisturbanceWriter:
    """Writes disturbances of the arm."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._pushes = {kind: np.zeros(len(context.names)) for kind in entities.PUSHES}
        self._arrows: set[str] = set()
        self._tick = -1

    def write(self, received: list[Received[m.Disturbance]]) -> None:
        """Write every change."""
        context = self._context
        for one in received:
            tick = context.runs.tick_at(one.message.time)
            row = context.row(tick, one.wall_ns)
            kinds = list(dict.fromkeys(_describe(active) for active in one.message.active))
            lane = " + ".join(dict.fromkeys(active.kind for active in one.message.active))
            context.trace.states(entities.DISTURBANCE_LANE.path, row, [lane or None])
            sentence = " and ".join(kinds) if kinds else "no disturbance any more"
            context.event(entities.DISTURBANCE_EVENT, row, sentence)
            self._write_steps(tick, one)
            self._write_arrows(row)

    def _write_steps(self, tick: int, one: Received[m.Disturbance]) -> None:
        """Write the sums of the pushes, and their old values one tick earlier, so that the step is vertical."""
        context = self._context
        pushes = {kind: np.zeros(len(context.names)) for kind in entities.PUSHES}
        for active in one.message.active:
            if active.kind in pushes and active.values is not None:
                pushes[active.kind] += active.values
        for kind, values in pushes.items():
            steps = [(tick, values)]
            if tick - 1 > self._tick:
                steps.insert(0, (tick - 1, self._pushes[kind]))
            rows = context.rows([at for at, _ in steps], [one] * len(steps))
            context.trace.joints(entities.PUSHES[kind], context.names, rows, [list(step) for _, step in steps])
        self._pushes, self._tick = pushes, tick

    def _write_arrows(self, row: Rows) -> None:
        """Write an arrow on each pushed link, in the direction of the tool's motion."""
        context, config = self._context, self._context.config
        strength = self._pushes["acceleration"] / config.limits.accelerations + self._pushes["torque"] / config.torques
        shown = set()
        for joint in np.flatnonzero(strength):
            body, origin, direction = context.scene.push_arrow(int(joint), context.pose)
            length = np.sign(strength[joint]) * (ARROW_M[0] + ARROW_M[1] * min(1.0, abs(strength[joint])))
            arrow = rr.Arrows3D.columns(
                vectors=[length * direction], origins=[origin], colors=[COLOUR], radii=[RADIUS_M]
            )
            context.trace.send(entities.PUSH_ARROW.at(body), row, arrow)
            shown.add(body)
        for body in self._arrows - shown:
            nothing = rr.Arrows3D.columns(vectors=[]).partition([0])
            context.trace.send(entities.PUSH_ARROW.at(body), row, nothing)
        self._arrows = shown


def _describe(active: m.ActiveDisturbance) -> str:
    if active.kind == "sensor_noise":
        return f"sensor noise of {active.position_std or 0:.3g} rad and {active.velocity_std or 0:.3g} rad/s"
    if active.kind == "loss":
        return f"loss of {active.stream}"
    if active.values is None:
        return active.kind
    what, unit = KINDS.get(active.kind, (active.kind, ""))
    return f"{what} [{', '.join(f'{value:g}' for value in active.values)}]{unit}"
