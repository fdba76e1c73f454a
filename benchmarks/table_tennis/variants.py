"""The conditions under which balls are played."""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

Method = Literal["qp", "dmp", "quintic"]
SERIES = 50
"""Number of balls, by their seeds, after which the learned restitution is reset to a wrong one."""


@dataclass(frozen=True, slots=True)
class Variant:
    """Conditions.

    environment: fancy_gym's class. noise: m, of each sight. table, racket: relative errors of the assumed restitutions,
    with random sign, for each ball and each series. corrected: after the first choice. learns: from outgoing balls.
    scale: of the limits. period: s between corrections, or attempts to choose. earliest: s, earliest desired hit. wind:
    wind blows, and velocities are observed. simulated: hits are chosen with a simulated contact. options: of the
    chooser.
    """

    name: str
    environment: str = "TableTennisEnv"
    method: Method = "qp"
    noise: float = 0.0
    table: float = 0.0
    racket: float = 0.0
    corrected: bool = True
    learns: bool = False
    scale: float = 1.0
    period: float = 0.032
    earliest: float = 0.0
    wind: bool = False
    simulated: bool = True
    options: dict[str, Any] = field(default_factory=dict)


CALM = Variant("calm", corrected=False)
NOISE = Variant("noise", noise=0.005, table=0.1)
UNCORRECTED = {"early_cost": 0.0, "use_cost": 0.0}
"""A hit without corrections need not leave time and room for them."""
WIDER = {
    "time_shifts": (-0.06, -0.03, 0.0, 0.03, 0.06, 0.09, 0.12),
    "flight_shifts": (-0.2, -0.1, -0.05, 0.0, 0.05, 0.1, 0.2),
}
"""A target that jumps by a metre needs larger corrections than a better estimate of a ball."""
VARIANTS = {
    variant.name: variant
    for variant in (
        CALM,
        replace(CALM, name="calm-dmp", method="dmp"),
        replace(CALM, name="calm-quintic", method="quintic"),
        replace(CALM, name="calm-law", simulated=False),
        NOISE,
        replace(NOISE, name="noise-once", corrected=False, options=UNCORRECTED),
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
