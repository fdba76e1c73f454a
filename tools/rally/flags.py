"""Flags of `volley rally`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from protocol import messages as m
from robot.striking.launcher import Kind
from services.common.cli import Common, Options


@dataclass(frozen=True, slots=True)
class Flags:
    """Throw balls, which the arm returns to a target; print a table and write a trace.

    Attributes:
        balls: Number of balls.
        target: Where the balls must land, m; z is the height of the court.
        kind: Whether the balls bounce before they arrive.
        noise: Standard deviation of each coordinate of the measured ball, m.
        latency: Delay of the ball's measurements, s.
        wind: Wind across the court, m/s; the striker does not know it.
        wander: The target jumps within this distance of `target` (m, along x and y), before each ball and during its
            flight.
        drag_error: Relative error of the striker's drag coefficient; positive: too large.
        restitution_error: Relative error of the striker's restitution of the court; positive: too large.
        seed: Seed of the throws and the noise.
        method: qp corrects the swing; once plans it once; dmp plans it once with a movement primitive; quintic
            plans it once as one polynomial, without a demonstration.
        revise_hz: Rate of corrections, Hz.
        slow: Ratio of wall time to robot time. A larger one gives striker and planner more time for each decision on a
            busy machine.
        learned: File for the striker's learned values, with two arms a directory; by default temporary.
        record: Trace to write.
        live: Serve a live viewer on loopback.
        partners: 1: balls are thrown at one arm; 2: two arms, near and far, rally with each other, each with its own
            target; balls, kind, target, wander and wind then have no effect.
        rallies: With two arms: number of rallies.
        strokes: With two arms: number of strokes after which a rally ends.
        json: Print one line of JSON instead of the table.
        verbose: Show the services' logs.
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

    @property
    def correction_hz(self) -> float:
        """Rate of corrections, Hz."""
        return self.revise_hz if self.method == "qp" else 0.0

    def service_flags(self) -> dict[str, object]:
        """Return the flags of the services, by name."""
        method = "qp" if self.method == "once" else self.method
        return {"record": self.record, "live": self.live, "seed": self.seed, "pace": 1 / self.slow, "method": method}

    def camera_noise(self) -> m.Disturb | None:
        """Return the request for the camera's noise, or None for an exact camera."""
        if not self.noise and not self.latency:
            return None
        return m.Disturb(kind="ball_noise", position_std=self.noise, latency_s=self.latency, drop_rate=0.0)

    def check(self, *names: str) -> None:
        """Raise ValueError for a flag of these names that is less than 1."""
        for name in names:
            value = getattr(self, name)
            if not value >= 1:
                raise ValueError(f"--{name} is {value}; it must be 1 or more")
