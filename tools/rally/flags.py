"""Flags of `volley rally`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from protocol import messages as m
from robot.striking.launcher import Kind
from services.common.cli import Common, Options


@dataclass(frozen=True, slots=True)
class Flags:
    """Throw balls at the arm, which returns them to a target; print a table and leave a trace.

    Attributes:
        balls: How many.
        target: Where they shall land, m; z is the height of the court.
        kind: Whether the balls bounce before they arrive.
        noise: Standard deviation of each coordinate of a sight, m.
        latency: From a sight of the ball to its message, s.
        wind: Across the court, m/s; the striker does not know of it.
        wander: How far (m, along x and y) the target jumps about `target`: before each ball, and again while it flies.
        drag_error: Part by which the striker believes in too much drag.
        restitution_error: Part by which the striker believes in too high a bounce.
        seed: Of the throws and the noise.
        method: qp corrects the swing; once plans it once; dmp plans it once by the movement primitive; quintic
            plans it once as one polynomial, without a demonstration.
        revise_hz: Corrections a second.
        slow: Wall time over robot time, for machines that are busy: striker and planner have that much more time for
            each decision.
        learned: File of what the striker has learned; by default a new one, thrown away at the end.
        record: The trace to write.
        live: Serve a viewer on loopback meanwhile.
        partners: 1: balls are thrown at one arm; 2: two arms, near and far, rally with each other, each with a target
            of its own; balls, kind, target, wander and wind are then of no effect.
        rallies: Of two arms, how many.
        strokes: Of two arms, after which a rally ends.
        json: Print one line of JSON in place of the table.
        verbose: Show what the services log.
    """

    common: Common = field(default_factory=Options)
    balls: int = 20
    target: tuple[float, float, float] = (4.5, 0.0, 0.0)
    kind: Kind = "bounce"
    noise: float = 0.0
    latency: float = 0.0
    wind: float = 0.0
    wander: float = 0.0
    drag_error: float = 0.0
    restitution_error: float = 0.0
    seed: int = 0
    method: Literal["qp", "once", "dmp", "quintic"] = "qp"
    revise_hz: float = 50.0
    slow: float = 1.0
    learned: Path | None = None
    record: Path = Path("volley-rally.rrd")
    live: bool = False
    partners: Literal[1, 2] = 1
    rallies: int = 3
    strokes: int = 60
    json: bool = False
    verbose: bool = False


def noise_of(flags: Flags) -> m.Disturb | None:
    """Return what blurs a camera; None where it sees exactly."""
    if not flags.noise and not flags.latency:
        return None
    return m.Disturb(kind="ball_noise", position_std=flags.noise, latency_s=flags.latency, drop_rate=0.0)
