"""`python -m benchmarks.table_tennis`: balls of fancy_gym's table tennis, returned by the planner; no training."""

import json
import os
import sys
import time
from dataclasses import dataclass, replace
from math import sqrt
from pathlib import Path
from tempfile import gettempdir

import numpy as np
import tyro

from benchmarks.table_tennis.player import Ball, Player, Variant
from benchmarks.table_tennis.scene import NotInstalled

NOISE = Variant("noise", noise=0.005, table=0.1)
CALM = Variant("calm", corrected=False)
WIDER = {
    "time_shifts": (-0.06, -0.03, 0.0, 0.03, 0.06, 0.09, 0.12),
    "flight_shifts": (-0.2, -0.1, -0.05, 0.0, 0.05, 0.1, 0.2),
}
"""A target that jumps by a metre asks for larger corrections than a ball that is known better."""
VARIANTS = {
    variant.name: variant
    for variant in (
        CALM,
        replace(CALM, name="calm-law", simulated=False),
        replace(CALM, name="calm-dmp", method="dmp"),
        replace(CALM, name="calm-quintic", method="quintic"),
        NOISE,
        replace(NOISE, name="noise-once", corrected=False),
        replace(NOISE, name="noise-dmp", method="dmp"),
        replace(NOISE, name="noise-quintic", method="quintic"),
        replace(NOISE, name="noise-law", simulated=False),
        replace(NOISE, name="racket", racket=0.1, learns=True),
        replace(NOISE, name="racket-unlearned", racket=0.1),
        Variant("wind", environment="TableTennisWind", wind=True, corrected=False),
        Variant("switching", environment="TableTennisGoalSwitching", earliest=1.15, options=WIDER),
        replace(CALM, name="half", scale=0.5),
        replace(NOISE, name="noise-half", scale=0.5),
    )
}
Z = 1.959964
"""Of a two-sided 95 % interval."""


@dataclass(frozen=True)
class Arguments:
    """Balls of fancy_gym's table tennis.

    variants: names. balls: of each. seed: of the first ball's; the next ones follow. json: write the figures as JSON.
    verbose: a line for each ball that is no success. seconds: begin no further ball of a variant after so long.
    """

    variants: tuple[str, ...] = ("calm", "noise", "noise-once", "racket", "wind", "switching", "half")
    balls: int = 100
    seed: int = 0
    json: bool = False
    verbose: bool = False
    seconds: float = float("inf")


def wilson(successes: int, count: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a rate."""
    if not count:
        return 0.0, 1.0
    rate, z = successes / count, Z * Z / count
    middle, half = rate + z / 2, Z * sqrt(rate * (1 - rate) / count + z / (4 * count))
    return (middle - half) / (1 + z), (middle + half) / (1 + z)


def summary(balls: list[Ball]) -> dict[str, object]:
    """Return the figures of a variant."""
    count, found = len(balls), dict[str, object]()
    found["balls"] = count
    for name in ("planned", "hit", "returned", "success"):
        number = sum(getattr(ball, name) for ball in balls)
        found[name], found[f"{name}_95"] = number, [round(part, 4) for part in wilson(number, count)]
    errors = [ball.error for ball in balls if np.isfinite(ball.error)]
    found["median_error_m"] = round(float(np.median(errors)), 4) if errors else None
    found["violations"] = sum(ball.violations for ball in balls)
    found["corrections"] = round(sum(ball.corrections for ball in balls) / count, 2)
    found["refused"] = round(sum(ball.refused for ball in balls) / count, 2)
    firsts = [ball.first_ms for ball in balls if np.isfinite(ball.first_ms)]
    later = [ms for ball in balls for ms in ball.correction_ms]
    for name, values in (("first_ms", firsts), ("correction_ms", later)):
        found[name] = np.percentile(values, [50, 99]).round(1).tolist() if values else None
    return found


def run(variant: Variant, arguments: Arguments) -> tuple[dict[str, object], list[Ball]]:
    """Play a variant."""
    folder = Path(gettempdir()) / f"volley-table-tennis-{os.getuid()}" / variant.name
    folder.mkdir(parents=True, exist_ok=True)
    player = Player(variant, folder, arguments.seed)
    balls = list[Ball]()
    began = time.monotonic()
    for number in range(arguments.balls):
        if time.monotonic() - began > arguments.seconds:
            break
        ball = player.play(arguments.seed + number)
        balls.append(ball)
        if arguments.verbose and not ball.success:
            print(f"  {arguments.seed + number}: {ball}", file=sys.stderr)
    found = {"variant": variant.name, "seed": arguments.seed} | summary(balls)
    if variant.learns:
        found["after_20"] = summary(balls[20:])["success"] if len(balls) > 20 else None
        found["law"] = [player.learner.law.restitution, player.learner.law.friction]
    return found, balls


def main() -> int:
    """Play, and print a table or JSON."""
    arguments = tyro.cli(Arguments)
    unknown = [name for name in arguments.variants if name not in VARIANTS]
    if unknown:
        print(f"variants: there is no {unknown[0]!r}; there are {', '.join(VARIANTS)}", file=sys.stderr)
        return 2
    try:
        for name in arguments.variants:
            found, _ = run(VARIANTS[name], arguments)
            print(json.dumps(found) if arguments.json else "  ".join(f"{k} {v}" for k, v in found.items()), flush=True)
    except NotInstalled as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
