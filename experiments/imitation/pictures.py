"""Figures of demonstrations and of plans."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.recordings import HANDWRITING, PICK_AND_PLACE, TWELVE_BITS, WIPING, Movement, Recorder
from experiments import style
from experiments.imitation.conditions import ENDS_TIMES, PLACE_TIMES, other_ends, peak_speed
from experiments.imitation.own import CLEAN, GRID, ask, learned
from experiments.imitation.recorded import PAPER, Recorded
from motion.primitive import learn
from motion.trajectory import Samples

SHOWN: dict[str, Any] = {
    "color": style.COLOURS["demonstration"],
    "linewidth": 3.5,
    "alpha": 0.55,
    "label": "demonstration",
}
PLAYED: dict[str, Any] = {"color": "#111111", "linewidth": 1.0}
THIN: dict[str, Any] = {"color": "#111111", "linewidth": 0.6}
VARIANTS = "#c8501e", "#1f5fa8", "#3fa7a0"
RECORDER = Recorder(500, tick=TWELVE_BITS)
RATIO = 0.8
LETTERS_A_ROW = 6
SECONDS = {WIPING.name: 3.0, HANDWRITING.name: 3.0}
"""Seconds shown of movements with too many strokes to be legible."""


def movements(cases: Sequence[Movement]) -> Figure:
    """Draw each movement and its plan, learned from an encoder of 12 bit, and their distance below."""
    title = f"Demonstration and plan, recorded with {RECORDER} (an encoder of 12 bit)"
    figure, axes = _columns(title, ("position, rad", "deviation, mrad"), len(cases), height=1.9)
    for case, (position, deviation) in zip(cases, axes, strict=True):
        times = np.linspace(0, case.duration, GRID)
        shown, played = case.positions(times), ask(learned(case, RECORDER)).sample(times).positions[:, 0]
        _pair(position, times, shown, times, played)
        deviation.plot(times, 1e3 * (played - shown), **PLAYED)
        _title((position, deviation), case.name, case)
    _legend(figure, axes[0][0])
    return figure


def arms(recordings: Sequence[Recorded]) -> Figure:
    """Draw each joint of each recording and its plan, and the largest deviation of any joint at the bottom."""
    joints = [f"joint {name}, rad" for name in recordings[0].joints]
    title = "Demonstration and plan: household tasks, shown by hand to an arm of seven joints"
    figure, axes = _columns(title, (*joints, "deviation, mrad"), len(recordings), height=1.2)
    for recording, (*positions, deviation) in zip(recordings, axes, strict=True):
        times, shown, played = _own(recording)
        for joint, ax in enumerate(positions):
            _pair(ax, times, shown[:, joint], times, played.positions[:, joint])
        deviation.plot(times, 1e3 * np.abs(played.positions - shown).max(axis=1), **THIN)
        positions[0].set_title(recording.name, fontsize=9)
    _legend(figure, axes[0][0])
    return figure


def poses(recordings: Sequence[Recorded]) -> Figure:
    """Draw the tool's path from the side and its rotation, for every recording."""
    figure, axes = _columns("Demonstration and plan: the tool's poses in a pouring task", 6 * ("",), 3, height=1.7)
    panels = [(column[row], column[row + 1]) for row in (0, 2, 4) for column in axes]
    for recording, (path, rotation) in zip(recordings, panels, strict=True):
        times, shown, played = _own(recording)
        _pair(path, shown[:, 1], shown[:, 2], played.positions[:, 1], played.positions[:, 2])
        path.set_title(recording.name, fontsize=9)
        path.set(xlabel="y, m", ylabel="z, m")
        for axis in range(3, 6):
            _pair(rotation, times, shown[:, axis], times, played.positions[:, axis])
        rotation.set(xlabel="time, s", ylabel="rotation, rad")
    _legend(figure, axes[0][0])
    return figure


def letters(recordings: Sequence[Recorded]) -> Figure:
    """Draw the first recording of every letter and its plan, on paper."""
    rows = -(-len(recordings) // LETTERS_A_ROW)
    figure, axes = _columns("Demonstration and plan: handwriting, mm", rows * ("",), LETTERS_A_ROW, height=1.5)
    panels = [column[row] for row in range(rows) for column in axes]
    for recording, ax in zip(recordings, panels, strict=False):
        _, shown, played = _own(recording)
        _pair(ax, *(shown / PAPER).T, *(played.positions / PAPER).T)
        ax.set_title(recording.name, fontsize=8)
    for ax in panels:
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel("")
        ax.tick_params(labelsize=7)
    _legend(figure, panels[0])
    return figure


def limited() -> Figure:
    """Draw the pick and place under a speed limit, with and without a place term."""
    primitive = learned(PICK_AND_PLACE, CLEAN)
    times = np.linspace(0, PICK_AND_PLACE.duration, GRID)
    shown, speed = PICK_AND_PLACE.positions(times), RATIO * peak_speed(primitive)
    title = f"Pick and place with a speed limit at {RATIO:g} of its peak"
    figure, axes = style.panels(title, ("position, rad", "deviation, rad", "velocity, rad/s"))
    axes[0].plot(times, shown, **SHOWN)
    axes[2].plot(times, np.gradient(shown, times), **SHOWN)
    labels = "without a place term", "as planned", "place_time 0.25 s"
    for place_time, colour, label in zip(PLACE_TIMES.values(), VARIANTS, labels, strict=True):
        played = ask(primitive, speed=speed, place_time=place_time).sample(times)
        curves = played.positions[:, 0], played.positions[:, 0] - shown, played.velocities[:, 0]
        for ax, curve in zip(axes, curves, strict=True):
            ax.plot(times, curve, color=colour, linewidth=1.2, label=label)
    style.bound(axes[2], (speed, -speed), "limit")
    _legend(figure, axes[2])
    return figure


def adapted() -> Figure:
    """Draw movements between other ends, with differences spread over the whole motion or kept near the ends."""
    cases = other_ends()
    labels = "position, rad", "deviation, rad", "acceleration, rad/s²"
    figure, axes = _columns("Played between other ends", labels, len(cases), height=2.2)
    for (name, (movement, primitive, start, goal)), column in zip(cases.items(), axes, strict=True):
        times = np.linspace(0, movement.duration, GRID)
        shown = movement.positions(times)
        column[0].plot(times, shown, **SHOWN)
        column[2].plot(times, primitive.sample(times / movement.duration).accelerations[:, 0], **SHOWN)
        for (label, place_time), colour in zip(ENDS_TIMES.items(), VARIANTS, strict=True):
            played = ask(primitive, start, goal, place_time=place_time).sample(times)
            curves = played.positions[:, 0], played.positions[:, 0] - shown, played.accelerations[:, 0]
            for ax, curve in zip(column, curves, strict=True):
                ax.plot(
                    times,
                    curve,
                    color=colour,
                    linewidth=1.1,
                    label=f"place_time {label}" if place_time else "no place_time",
                )
        _title(column, name.replace(", ", ",\n", 1), movement)
    _legend(figure, axes[0][0])
    return figure


def _own(recording: Recorded) -> tuple[np.ndarray, np.ndarray, Samples]:
    """Return times (n,), the demonstration (n, J) and the plan."""
    demonstration = recording.demonstration
    times = demonstration.times - demonstration.times[0]
    return times, demonstration.positions, ask(learn(demonstration)).sample(times)


def _pair(ax: Axes, x: np.ndarray, shown: np.ndarray, along: np.ndarray, played: np.ndarray) -> None:
    """Draw a demonstration, broad and grey, and its plan on top, thin and black."""
    ax.plot(x, shown, **SHOWN)
    ax.plot(along, played, label="plan", **PLAYED)


def _title(column: Sequence[Axes], title: str, movement: Movement) -> None:
    """Set a column's title, and the range of time of a movement with many strokes."""
    if shown := SECONDS.get(movement.name):
        title = f"{title} (first {shown:g} s)"
        for ax in column:
            ax.set_xlim(0, shown)
    column[0].set_title(title, fontsize=9)


def _legend(figure: Figure, ax: Axes) -> None:
    """Add the legend of a panel below the figure."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8)


def _columns(title: str, labels: Sequence[str], count: int, height: float) -> tuple[Figure, list[list[Axes]]]:
    """Make columns of panels, labelled at the left."""
    figure, axes = style.panels(title, [*labels, *(count - 1) * len(labels) * [""]], columns=count, height=height)
    return figure, [axes[k : k + len(labels)] for k in range(0, len(axes), len(labels))]
