"""One style for all figures."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

UNITS = ("position, rad", "velocity, rad/s", "acceleration, rad/s²")
COLOURS = {
    "demonstration": "#7f7f7f",
    "gaussian": "#1f5fa8",
    "gaussian variant": "#3fa7a0",
    "qp": "#111111",
    "dmp": "#c8501e",
    "dmp variant": "#d9a400",
    "limit": "#a01c2c",
}


def panels(title: str, labels: Sequence[str], columns: int = 1, height: float = 2.2) -> tuple[Figure, list[Axes]]:
    """Make a figure with one panel for each y label, column by column, and time on the lowest x axes."""
    rows = -(-len(labels) // columns)
    figure = Figure(figsize=(8.0 if columns == 1 else 11.0, 0.8 + height * rows), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=11)
    axes = list(figure.subplots(rows, columns, squeeze=False).T.flat)
    for number, (ax, label) in enumerate(zip(axes, labels, strict=True)):
        ax.set_ylabel(label)
        ax.grid(alpha=0.3)
        ax.spines[["top", "right"]].set_visible(False)
        if (number + 1) % rows == 0:
            ax.set_xlabel("time, s")
    return figure, axes


def draw(
    axes: Sequence[Axes], times: np.ndarray, values: Sequence[np.ndarray], name: str, label: str, **more: Any
) -> None:
    """Draw one curve in each panel, in the colour of `name`."""
    for ax, curve in zip(axes, values, strict=True):
        ax.plot(times, curve, color=COLOURS[name], label=label, **{"linewidth": 1.6, **more})


def bound(ax: Axes, values: Sequence[float], label: str, **more: Any) -> None:
    """Draw horizontal lines at limits, with one label."""
    for number, value in enumerate(values):
        style = {"linestyle": "--", "linewidth": 1.2, "color": COLOURS["limit"], **more}
        ax.axhline(value, label=label if number == 0 else None, **style)


def mark(axes: Sequence[Axes], time: float, values: Sequence[float], label: str, marker: str = "o") -> None:
    """Mark a point in each of the first panels."""
    for ax, value in zip(axes, values, strict=False):
        ax.plot(time, value, marker, color="black", markersize=5, label=label, zorder=5)


def legend(ax: Axes, **more: Any) -> None:
    """Add the legend of a panel."""
    ax.legend(fontsize=8, framealpha=0.9, **more)
