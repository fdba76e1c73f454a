"""Results of the balls: one line of JSON for each, so that a long run can be interrupted, and their statistics."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from math import sqrt
from pathlib import Path

import numpy as np

from benchmarks.table_tennis.variants import SERIES

Z = 1.959964
"""Quantile of a two-sided 95 % interval."""
LEARNED = 20
"""Number of balls of a series after which the racket's restitution counts as learned."""


@dataclass(slots=True)
class Ball:
    """Result of one ball: whether it was planned, the environment's verdict, error (m), and how it was played.

    violations: of the plan's limits, at 10 kHz. arm_violations: physics steps before the hit at which the arm itself
    was outside its range or faster than its velocity limits. arm_velocity, arm_acceleration: largest part of a limit
    that the arm used before the hit, between physics steps. off_plan: rad, largest distance from the plan before the
    hit. refused: number of choices and corrections without a hit or a plan; note: the reason of the last. first_ms,
    correction_ms: processor time until the first hit was chosen that is then planned. planned_ms: of a correction, with
    all plans and checks.
    """

    planned: bool = False
    hit: bool = False
    returned: bool = False
    success: bool = False
    error: float | None = None
    violations: int = 0
    arm_violations: int = 0
    arm_velocity: float = 0.0
    arm_acceleration: float = 0.0
    off_plan: float = 0.0
    corrections: int = 0
    refused: int = 0
    first_ms: float | None = None
    correction_ms: list[float] = field(default_factory=list, repr=False)
    planned_ms: list[float] = field(default_factory=list, repr=False)
    note: str = ""


def append(path: Path, variant: str, seed: int, ball: Ball) -> None:
    """Append a ball to a file."""
    with path.open("a") as file:
        file.write(json.dumps({"variant": variant, "seed": seed} | asdict(ball)) + "\n")


def read(path: Path, variant: str) -> dict[int, Ball]:
    """Return the balls of a variant by seed; empty if the file does not exist.

    Raises:
        ValueError: a line cannot be decoded; the sentence gives its number.
    """
    found: dict[int, Ball] = {}
    lines = path.read_text().splitlines() if path.exists() else []
    for number, line in enumerate(lines, 1):
        try:
            entry = json.loads(line)
            name, seed = entry.pop("variant"), int(entry.pop("seed"))
            ball = Ball(**entry)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ValueError(
                f"{path}: line {number} cannot be read as a ball ({error}); remove it, or name another file"
            ) from error
        if name == variant:
            found[seed] = ball
    return found


def wilson(successes: int, count: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a rate."""
    if not count:
        return 0.0, 1.0
    rate, z = successes / count, Z * Z / count
    middle, half = rate + z / 2, Z * sqrt(rate * (1 - rate) / count + z / (4 * count))
    return (middle - half) / (1 + z), (middle + half) / (1 + z)


COLUMNS = (
    "variant",
    "balls",
    "planned",
    "hit",
    "returned",
    "success (95 % interval)",
    "median error",
    "violations: plan; arm",
    "arm's velocity, acceleration",
    "corrections, refused",
    "first choice p50, p99",
    "correction p50, p99",
    "with planning",
)
HEADING = f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}"


def row(name: str, balls: Sequence[Ball]) -> str:
    """Return the statistics of balls as a row of the table under `HEADING`."""
    count = len(balls)
    rates = [f"{share(sum(getattr(ball, name) for ball in balls), count)}" for name in ("planned", "hit", "returned")]
    success = sum(ball.success for ball in balls)
    low, high = wilson(success, count)
    errors = [ball.error for ball in balls if ball.error is not None]
    firsts = [ball.first_ms for ball in balls if ball.first_ms is not None]
    later = [ms for ball in balls for ms in ball.correction_ms]
    planned = [ms for ball in balls for ms in ball.planned_ms]
    cells = [
        name,
        str(count),
        *rates,
        f"{share(success, count)} ({100 * low:.1f}–{100 * high:.1f})",
        f"{100 * np.median(errors):.1f} cm" if errors else "",
        f"{sum(ball.violations for ball in balls)}; {sum(ball.arm_violations for ball in balls)}",
        f"{max(ball.arm_velocity for ball in balls):.2f}, {max(ball.arm_acceleration for ball in balls):.2f}",
        f"{_mean([ball.corrections for ball in balls])}, {_mean([ball.refused for ball in balls])}",
        _times(firsts),
        _times(later),
        _times(planned),
    ]
    return f"| {' | '.join(cells)} |"


def rows(name: str, balls: dict[int, Ball], learns: bool) -> list[str]:
    """Return the row of a variant; if it learns, also a row of the balls after the first ones of each series."""
    found = [row(name, list(balls.values()))]
    later = [ball for seed, ball in balls.items() if seed % SERIES >= LEARNED]
    if learns and later:
        found.append(row(f"{name}, after {LEARNED} balls", later))
    return found


def share(number: int, count: int) -> str:
    """Return a part in percent."""
    return f"{100 * number / count:.1f} %"


def _mean(values: list[int]) -> str:
    return f"{np.mean(values):.1f}"


def _times(values: list[float]) -> str:
    return "{:.0f}, {:.0f} ms".format(*np.percentile(values, [50, 99])) if values else ""
