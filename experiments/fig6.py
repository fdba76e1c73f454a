"""Section IV-E, fig. 6: noise of 0.01 rad on the demonstration, with and without the Savitzky-Golay filter."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from experiments import style
from experiments.common import (
    STEP,
    TIMES,
    Outcome,
    Row,
    ask,
    curves,
    demonstrated,
    demonstration,
    gaussian,
    qp,
    rms,
    rollout,
    spread,
)
from motion.demonstration import SavitzkyGolay, Smoothing
from motion.dmp import learn_dmp
from motion.primitive import learn

AMPLITUDE = 0.01  # rad, half-width of uniform noise
RUNS = 100
FILTERS: dict[str, Smoothing] = {
    "none": SavitzkyGolay(3 * STEP, 2),  # the plain differences of neighbours
    "savitzky_golay_201": SavitzkyGolay(0.201, 5),  # the authors' window and order
    "auto": "auto",
}
METHODS = {"gaussian": "QP of the paper", "qp": "QP of Volley", "dmp": "DMP"}
WINDOWS = (21, 41, 61, 81, 101, 151, 201, 251, 301, 401, 501)
AMPLIFIED = "the noise is amplified to 10 rad/s in velocity and 10000 rad/s² in acceleration (fig. 6)"
FILTERED = "the filter results in better imitation for both (fig. 6)"
DMP_HELPS = "position and velocity in the forcing term help the DMP against noise; filtering is needed by the QP (IV-E)"


def run(chosen: Sequence[int] = range(RUNS)) -> Outcome:
    """Learn one noisy demonstration for the figure, many for the statistics, and with windows of several lengths.

    chosen: numbers of the noisy demonstrations, of which the first is that of the figure; by default all.
    """
    noise = np.random.default_rng(7).uniform(-AMPLITUDE, AMPLITUDE, (RUNS, len(TIMES)))
    noisy = demonstrated(TIMES)[0] + noise[chosen]
    rows = [
        Row("fig6.amplified.velocity", float(np.abs(np.diff(noise[0])).max() / STEP), "rad/s", AMPLIFIED),
        Row("fig6.amplified.acceleration", float(np.abs(np.diff(noise[0], 2)).max() / STEP**2), "rad/s²", AMPLIFIED),
    ]
    shown = {}
    for name, smoothing in FILTERS.items():
        motions = [learned(positions, smoothing) for positions in noisy]
        shown |= {f"{method}.{name}": motion for method, motion in motions[0].items()}
        for method in METHODS:
            claim = None if method == "qp" else DMP_HELPS if name == "none" else FILTERED
            errors = [rms(motion[method][2] - demonstrated(TIMES)[2]) for motion in motions]
            paths = [rms(motion[method][0] - demonstrated(TIMES)[0]) for motion in motions]
            rows += spread(f"fig6.{method}.{name}.imitation_rms", errors, "rad/s²", claim)
            rows += spread(f"fig6.{method}.{name}.position_rms", paths, "rad", claim)
    windows = {w: learned(noisy[0], SavitzkyGolay(w * STEP, 5)) for w in WINDOWS}
    by_window = {
        m: [rms(motions[m][2] - demonstrated(TIMES)[2]) for motions in windows.values()] for m in ("gaussian", "dmp")
    }
    for method, values in by_window.items():
        rows += [
            Row(f"fig6.{method}.window_{w}.imitation_rms", value, "rad/s²")
            for w, value in zip(WINDOWS, values, strict=True)
        ]
    return Outcome(rows, picture(shown, by_window), curves("fig6", TIMES, shown))


def learned(positions: np.ndarray, smoothing: Smoothing) -> dict[str, np.ndarray]:
    """Return each method's motion (3, n) to the clean demonstration's goal, learned from positions (n,)."""
    primitive = learn(demonstration(positions), smoothing)
    request = ask()
    motions = gaussian(primitive, request)[1], qp(primitive, request)[1], rollout(learn_dmp(primitive), request)
    return dict(zip(METHODS, motions, strict=True))


def picture(shown: dict[str, np.ndarray], by_window: dict[str, list[float]]) -> Figure:
    """Draw motions without the filter (left), with it (right), and the effect of the window's length (below)."""
    bends, path = "acceleration, rad/s²", "position, rad"
    figure, axes = style.panels(
        "Fig. 6  Noise of 0.01 rad on the demonstration: not filtered (left), Savitzky-Golay of 201 samples (right)",
        (
            f"{bends}\n(QP)",
            f"{bends}\n(DMP)",
            path,
            bends,
            path,
            "imitation error, rad/s²",
        ),
        columns=2,
        height=2.6,
    )
    clean = demonstrated(TIMES)
    for ax, method in ((axes[0], "gaussian"), (axes[1], "dmp")):
        label = f"{METHODS[method]}, not filtered"
        style.draw([ax], TIMES, [shown[f"{method}.none"][2]], method, label, linewidth=0.8)
        style.draw([ax], TIMES, [clean[2]], "demonstration", "demonstration without noise", linewidth=1.2)
        style.legend(ax, loc="lower right")
    for ax, name, row in ((axes[2], "none", 0), (axes[4], "savitzky_golay_201", 0), (axes[3], "savitzky_golay_201", 2)):
        style.draw([ax], TIMES, [clean[row]], "demonstration", "demonstration without noise", linewidth=2.4)
        for method in ("gaussian", "dmp"):
            style.draw([ax], TIMES, [shown[f"{method}.{name}"][row]], method, METHODS[method], linewidth=1.2)
        if name != "none":
            label = "QP of Volley, learned by “auto”"
            style.draw([ax], TIMES, [shown["qp.auto"][row]], "qp", label, linewidth=1.0)
        style.legend(ax, loc="upper left" if name == "none" else "lower right")
    for method, values in by_window.items():
        axes[5].semilogy(WINDOWS, values, "o-", color=style.COLOURS[method], label=METHODS[method])
    axes[5].axvline(201, color="black", linewidth=0.8, linestyle=":", label="the authors' window")
    axes[5].set_xlabel("window, samples of 1 ms (order 5)")
    style.legend(axes[5])
    for ax in (axes[2], axes[4]):
        ax.set_xlabel("time, s")
    return figure
