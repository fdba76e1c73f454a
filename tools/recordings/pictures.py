"""Draw a preview: raw, fitted and imitated curves of every joint, with the doctor's findings."""

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from tools.recordings.doctor import Finding
from tools.recordings.preview import Preview
from tools.recordings.recording import Unreadable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RAW, FITTED, IMITATED = (150, 150, 160), (38, 139, 210), (245, 158, 66)
REPAIRED, LEFT = (63, 160, 90), (200, 60, 60)
"""Colours of repaired and remaining findings."""

FEW_SPANS = 20
"""Largest number of spans of a finding whose starts are drawn as lines; more lines would hide the curves."""

LINE, TITLE = 130, 90
"""Length, in characters, of lines under the curves and of the title."""


def picture(preview: Preview, path: Path) -> None:
    """Write a .png or an .rrd file.

    Raises:
        Unreadable: matplotlib is missing, or the file cannot be written.
    """
    try:
        (_png if path.suffix == ".png" else _rrd)(preview, path)
    except OSError as error:
        raise Unreadable(f"--plot {path} cannot be written: {error.strerror or error}") from None


def _png(preview: Preview, path: Path) -> None:
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ModuleNotFoundError:
        raise Unreadable(
            f"--plot {path} needs matplotlib: pip install 'volley[plot]', or give a file that ends in .rrd"
        ) from None
    names, findings = preview.examination.recording.columns, preview.examination.findings
    columns = 2 if len(names) > 4 else 1
    rows = -(-len(names) // columns)
    lines = [line for number, finding in enumerate(findings, 1) for line in _lines(number, finding)]
    lines += textwrap.wrap(f"not playable on this arm: {preview.refusal}", LINE) if preview.refusal else []
    height, below = 1.9 * rows + 0.9, 0.17 * len(lines) + 0.1
    figure = Figure(figsize=(11, height + below), dpi=110)
    FigureCanvasAgg(figure)
    parts: Any = figure.subfigures(2, 1, height_ratios=[height, below])
    upper, lower = parts
    grid = upper.subplots(rows, columns, sharex=True, squeeze=False)
    upper.subplots_adjust(left=0.07, right=0.98, top=1 - 0.5 / height, bottom=0.5 / height, hspace=0.25, wspace=0.16)
    source, episode = preview.raw.source, preview.raw.episode
    title = source.name if episode == source.stem else f"{source.name}, {episode}"
    upper.suptitle(title[:TITLE], fontsize=11, x=0.07, ha="left")
    axes = list(grid.T.flat)
    for number, ax in enumerate(axes[: len(names)]):
        _draw(ax, preview, number)
    for ax in axes[len(names) :]:
        ax.set_visible(False)
    for ax in (axes[rows - 1], axes[len(names) - 1]):  # the lowest of each column
        ax.set_xlabel("time, s", fontsize=8)
        ax.tick_params(labelbottom=True)
    upper.legend(*axes[0].get_legend_handles_labels(), loc="upper right", ncols=3, fontsize=8, frameon=False)
    lower.text(0.02, 0.98, "\n".join(lines), va="top", fontsize=7.5, linespacing=1.3)
    figure.savefig(path)


def _draw(ax: "Axes", preview: Preview, number: int) -> None:
    """Draw the curves and findings of one joint."""
    name = preview.examination.recording.columns[number]
    for mark, finding in enumerate(preview.examination.findings, 1):
        if finding.column in (None, name):
            _mark(ax, finding, mark)
    ax.plot(preview.raw.times, _in_radians(preview)[:, number], ".", ms=3, color=_colour(RAW), label="raw")
    ax.plot(preview.times, preview.fitted[:, number], color=_colour(FITTED), lw=2.2, label="fitted")
    if preview.imitated is not None:
        ax.plot(preview.times, preview.imitated[:, number], "--", color=_colour(IMITATED), lw=1.2, label="imitated")
    ax.set_ylabel(f"{name}, rad", fontsize=8)
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.25)
    ax.spines[["top", "right"]].set_visible(False)


def _mark(ax: "Axes", finding: Finding, number: int) -> None:
    """Shade the spans of a finding, and number the first one."""
    colour = _colour(REPAIRED if finding.repaired else LEFT)
    for index, (first, last) in enumerate(finding.spans):
        ax.axvspan(first, last, color=colour, alpha=0.18, lw=0)
        if len(finding.spans) <= FEW_SPANS:
            ax.axvline(first, color=colour, alpha=0.5, lw=0.8)
        if not index:
            at = ax.get_xaxis_transform()
            ax.text(first, 1.0, str(number), transform=at, color=colour, fontsize=7, va="bottom", ha="center")


def _lines(number: int, finding: Finding) -> list[str]:
    state = "repaired" if finding.repaired else "look"
    return textwrap.wrap(f"{number}  {state}: {finding.sentence}", LINE, subsequent_indent="    ")


def _colour(rgb: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*rgb)


def _in_radians(preview: Preview) -> np.ndarray:
    """Return the raw positions in rad."""
    converted = any(finding.code == "degrees" and finding.repaired for finding in preview.examination.findings)
    return np.radians(preview.raw.values) if preview.raw.unit == "deg" or converted else preview.raw.values


def _rrd(preview: Preview, path: Path) -> None:
    names, raw = preview.examination.recording.columns, preview.raw
    stream = rr.RecordingStream("volley_preview")
    views = [rrb.TimeSeriesView(origin=f"preview/{name}", name=name) for name in names]
    events = rrb.TextLogView(origin="preview/findings", name="findings")
    layout = rrb.Blueprint(rrb.Vertical(rrb.Grid(*views), events, row_shares=[4, 1]))
    stream.save(path, default_blueprint=layout)
    times, values = raw.times, _in_radians(preview)
    for number, name in enumerate(names):
        curves = [("raw", RAW, times, values), ("fitted", FITTED, preview.times, preview.fitted)]
        if preview.imitated is not None:
            curves.append(("imitated", IMITATED, preview.times, preview.imitated))
        for kind, colour, at, curve in curves:
            entity = f"preview/{name}/{kind}"
            stream.log(entity, rr.SeriesLines(colors=[colour], names=[kind]), static=True)
            axis = rr.TimeColumn("sim_time", duration=at)
            stream.send_columns(entity, [axis], rr.Scalars.columns(scalars=curve[:, number]))
    for finding in preview.examination.findings:
        stream.set_time("sim_time", duration=float(finding.times[0]) if len(finding.times) else float(times[0]))
        level = rr.TextLogLevel.INFO if finding.repaired else rr.TextLogLevel.WARN
        stream.log("preview/findings", rr.TextLog(finding.sentence, level=level))
    stream.disconnect()
