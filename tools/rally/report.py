"""The figures and the table of thrown balls."""

from collections.abc import Sequence

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from tools.rally.latency import LEGS, percentiles
from tools.rally.play import Stroke

MISSED = "-"


def summary(strokes: Sequence[Stroke]) -> dict[str, object]:
    """Return the figures of a rally: counts, median distance of returned balls from the target, m, latencies, ms.

    Latencies of corrections and of the first motion for each ball are separate.
    """
    distances = [s.score.distance for s in strokes if s.score.returned and s.score.distance is not None]
    found = [latency for stroke in strokes for latency in stroke.latencies]
    corrections = [latency for latency in found if not latency.is_first]
    return {
        "balls": len(strokes),
        "hit": sum(stroke.score.hit for stroke in strokes),
        "returned": len(distances),
        "within_30cm": sum(distance <= 0.3 for distance in distances),
        "within_20cm": sum(distance <= 0.2 for distance in distances),
        "median_error_m": round(float(np.median(distances)), 4) if distances else None,
        "corrections": sum(stroke.corrections for stroke in strokes),
        "aborted": sum(len(stroke.aborted()) for stroke in strokes),
        "touched": sum(len(stroke.forbidden_contacts) for stroke in strokes),
        "violations": sum(len(stroke.faults()) for stroke in strokes),
        "ticks_beyond": sum(stroke.limits.violations for stroke in strokes),
        "ticks_checked": sum(stroke.limits.ticks for stroke in strokes),
        "ticks_unseen": sum(stroke.limits.unseen for stroke in strokes),
        "recoil_peak": max((round(stroke.limits.recoil.fraction, 3) for stroke in strokes), default=0.0),
        "sight_to_command_ms": percentiles([latency.total for latency in corrections]),
        "first_sight_to_command_ms": percentiles([latency.total for latency in found if latency.is_first]),
        "legs_ms": {leg: percentiles([x.legs[k] for x in corrections])["p50"] for k, leg in enumerate(LEGS)},
    }


def table(strokes: Sequence[Stroke]) -> Table:
    """Return one row for each ball."""
    shown = Table(title="The rally", box=SIMPLE_HEAD, padding=0)
    for heading in ("ball", "arrives at\nm", "lands\nm", "off\ncm", "corr.", "sight to\ncmd. ms", "closest limit", ""):
        shown.add_column(heading, justify="right", no_wrap=True)
    for number, stroke in enumerate(strokes, 1):
        latency = percentiles([x.total for x in stroke.latencies if not x.is_first])["p50"]
        score = stroke.score
        shown.add_row(
            str(number),
            _place(stroke.launch.arrival),
            _place(score.landed_at[:2]) if score.landed_at else MISSED,
            f"{100 * score.distance:.0f}" if score.distance is not None else MISSED,
            str(stroke.corrections),
            f"{latency:.0f}" if latency is not None else MISSED,
            str(stroke.limits.closest) or MISSED,
            "[green]in[/green]" if score.returned else f"[red]{_fault(stroke)}[/red]",
        )
    return shown


def _fault(stroke: Stroke) -> str:
    """Return one word for why a ball was not returned."""
    if not stroke.score.hit:
        return "missed"
    return "net" if stroke.score.net else "out"


def reasons(strokes: Sequence[Stroke]) -> list[str]:
    """Return the striker's reasons for the balls that were not returned."""
    found = [(number, stroke.reason()) for number, stroke in enumerate(strokes, 1) if not stroke.score.returned]
    return [f"ball {number}: {reason}" for number, reason in found if reason]


def sentence(strokes: Sequence[Stroke]) -> str:
    """Return the figures in words."""
    found = summary(strokes)
    first, correction = found["first_sight_to_command_ms"], found["sight_to_command_ms"]
    assert isinstance(first, dict)
    assert isinstance(correction, dict)
    text = (
        f"{found['hit']} of {found['balls']} balls hit, {found['returned']} returned, {found['within_30cm']} within "
        f"30 cm of the target, {found['within_20cm']} within 20 cm; {found['corrections']} corrections"
    )
    for name, latency in (("a first motion", first), ("a correction", correction)):
        if latency["p50"] is not None:
            text += f"; {name} begins {latency['p50']} ms after its sight (median; p99 {latency['p99']} ms)"
    beyond = f"limits were exceeded at {found['ticks_beyond']} of {found['ticks_checked']} ticks"
    return f"{text}; {beyond}; {found['violations']} violations"


def _place(place: Sequence[float]) -> str:
    return " ".join(f"{value:.2f}" for value in place)
