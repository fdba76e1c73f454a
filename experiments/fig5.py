"""Section IV-D, fig. 5: sensor noise of 1 % and a push, in a simulation by Euler steps of eq. 11."""

import numpy as np
from matplotlib.figure import Figure

from experiments import style
from experiments.common import (
    GOALS,
    STEP,
    TIMES,
    Outcome,
    Row,
    ask,
    curves,
    figure_primitive,
    gaussian,
    spread,
)
from motion.tracking import tracking_acceleration

NOISE = 0.01
"""Half-width of the uniform noise, as a part of the largest position and of the largest velocity."""

PUSH, PUSH_FROM, PUSH_TO = 100.0, 0.1, 0.3  # rad/s², s, s
GAINS = (15.0, 25.0, 50.0, 100.0)
RECOVERED = 0.05  # rad
PAPER_GAIN = 15.0
RECOVERS = "recovers from the disturbance, accurately reaching the position and velocity goal (fig. 5)"
REJECTS = "manages to reject the noise (fig. 5)"


def run() -> Outcome:
    """Run every gain, with the push alone and with noise of many seeds."""
    _, reference = gaussian(figure_primitive(), ask())
    rows: list[Row] = []
    shown = {}
    rng = np.random.default_rng(6)
    for gain in GAINS:
        quiet = simulate(reference, gain, PUSH)
        noisy = simulate(reference, gain, PUSH, rng, GOALS)
        noise_alone = simulate(reference, gain, 0.0, rng, GOALS)
        shown[gain] = np.concatenate([quiet, noisy[:, :, :1], noise_alone[:, :, :1]], axis=2)
        rows += measured(f"fig5.gain_{gain:.0f}", reference, quiet, noisy, noise_alone)
    pushed = {f"gain_{gain:.0f}": motions[:, :, 1] for gain, motions in shown.items()}
    return Outcome(rows, picture(reference, shown), curves("fig5", TIMES, {"reference": reference} | pushed))


def simulate(
    reference: np.ndarray, gain: float, push: float, rng: np.random.Generator | None = None, runs: int = 1
) -> np.ndarray:
    """Return true position and velocity (2, n, runs) under eq. 11 along a reference (3, n).

    With `rng` each run has its own noise.
    """
    out = np.empty((2, reference.shape[1], runs))
    spans = [NOISE * np.abs(values).max() for values in reference[:2]]
    y, v = (np.full(runs, values[0]) for values in reference[:2])
    for k, (time, goal) in enumerate(zip(TIMES, reference.T[:, :, None], strict=True)):
        out[:, k] = y, v
        seen = (y, v) if rng is None else (x + rng.uniform(-s, s, runs) for x, s in zip((y, v), spans, strict=True))
        acceleration = tracking_acceleration(gain, tuple(goal), *seen) + push * (PUSH_FROM <= time < PUSH_TO)
        y, v = y + STEP * v, v + STEP * acceleration
    return out


def measured(name: str, reference: np.ndarray, quiet: np.ndarray, noisy: np.ndarray, noise: np.ndarray) -> list[Row]:
    """Return deviation, recovery and final errors of the push alone (2, n, 1) and with noise (2, n, runs)."""
    aim = reference[:2, :, None]
    quiet, noisy, noise = quiet - aim, noisy - aim, noise - aim
    outside = np.append(round(PUSH_TO / STEP), np.flatnonzero(np.abs(quiet[0, :, 0]) > RECOVERED))
    recovery = (outside.max() + 1) * STEP - PUSH_TO
    return [
        Row(f"{name}.peak_deviation", float(np.abs(quiet[0]).max()), "rad"),
        Row(f"{name}.recovery_time", recovery, "s after the push", RECOVERS),
        Row(f"{name}.final_position_error", float(abs(quiet[0, -1, 0])), "rad", RECOVERS),
        Row(f"{name}.final_velocity_error", float(abs(quiet[1, -1, 0])), "rad/s", RECOVERS),
        *spread(f"{name}.noisy.final_position_error", np.abs(noisy[0, -1]), "rad", RECOVERS),
        *spread(f"{name}.noisy.final_velocity_error", np.abs(noisy[1, -1]), "rad/s", RECOVERS),
        *spread(f"{name}.noise_alone.largest_deviation", np.abs(noise[0]).max(axis=0), "rad", REJECTS),
    ]


def picture(reference: np.ndarray, shown: dict[float, np.ndarray]) -> Figure:
    """Draw position, velocity and deviation for the paper's gain and the project's."""
    figure, axes = style.panels(
        "Fig. 5  A push of 100 rad/s² during 0.1–0.3 s, 1 % noise on both sensors (Euler steps of 1 ms)",
        (*style.UNITS[:2], "position less\nreference, rad", "the same, noise\nwithout push, rad"),
        height=2.3,
    )
    style.draw(axes[:2], TIMES, list(reference[:2]), "demonstration", "reference (QP of the paper)", linewidth=2.0)
    for gain, colour in ((PAPER_GAIN, "dmp"), (50.0, "qp")):
        pushed, alone = shown[gain][:, :, 1], shown[gain][0, :, 2]
        values = [*pushed, pushed[0] - reference[0], alone - reference[0]]
        style.draw(axes, TIMES, values, colour, f"gain {gain:.0f}/s")
    for number, ax in enumerate(axes[:3]):
        ax.axvspan(PUSH_FROM, PUSH_TO, color="#000000", alpha=0.07, label=None if number else "push")
    style.mark(axes, 1.0, (1.0, 3.0), "goal")
    style.bound(axes[2], (RECOVERED, -RECOVERED), "counts as recovered", linewidth=0.9)
    style.legend(axes[0], loc="lower right", ncols=2)
    style.legend(axes[2], loc="upper right")
    style.legend(axes[3], loc="upper right", ncols=2)
    return figure
