"""`python -m benchmarks.learning`: errors and duration of learning.

Accelerations are compared with the best Savitzky-Golay filter of order 5 in hindsight, which has the window with the
least error of all windows that fit into the recording. Positions are compared with the movement itself.
"""

import time
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.signal import savgol_filter

from benchmarks.machine import save
from benchmarks.recordings import (
    HANDWRITING,
    PICK_AND_PLACE,
    REACH,
    SLOW,
    STILL,
    STRIKE,
    TWELVE_BITS,
    WIPING,
    Movement,
    Recorder,
)
from motion.demonstration import Demonstration
from motion.primitive import learn

ACCELERATIONS = (
    (STRIKE, Recorder(500, 1e-3)),
    (STRIKE, Recorder(1000, 1e-2)),
    (REACH, Recorder(500, 1e-3)),
    (REACH, Recorder(200, tick=TWELVE_BITS)),
    (REACH, Recorder(100, 1e-3, jitter=0.3)),
    (STILL, Recorder(1000, 1e-2)),
)
RECORDERS = (
    Recorder(500),
    Recorder(500, 1e-3),
    Recorder(500, tick=1e-3),
    Recorder(1000, tick=1e-3),
    Recorder(500, tick=TWELVE_BITS),
    Recorder(1000, tick=TWELVE_BITS),
    Recorder(100, 1e-3, jitter=0.3),
)
PLACES = STRIKE, SLOW, PICK_AND_PLACE, WIPING, HANDWRITING
SIZES = (1000, 7), (100_000, 20)
WINDOWS = 30
DEMOS = Path(__file__).resolve().parents[2] / "shared" / "demos"
DEMO_DURATION = 4.0
"""Assumed duration, s, of recordings without times."""


def rms(values: np.ndarray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def acceleration_errors(movement: Movement, recorder: Recorder, seed: int) -> tuple[float, float]:
    """Return the rms error, rad/s², of the learned primitive and of the best filter."""
    times, positions = recorder.record(movement, seed)
    assert movement.accelerations is not None
    s = np.linspace(0, 1, 1001)
    truth = movement.accelerations(s * movement.duration)
    learned = learn(Demonstration(times, positions[:, None])).sample(s).accelerations[:, 0]
    uniform = np.linspace(0, times[-1], len(times))
    resampled = np.interp(uniform, times, positions)
    best = np.inf
    for window in np.unique(np.geomspace(7, len(times) - 2, WINDOWS).astype(int) | 1).tolist():
        found = np.asarray(savgol_filter(resampled, window, 5, deriv=2, delta=uniform[1]))
        best = min(best, rms(np.interp(s * movement.duration, uniform, found) - truth))
    return rms(learned - truth), best


def accelerations(seeds: int) -> list[dict[str, object]]:
    """Return the errors of every case over the seeds."""
    rows: list[dict[str, object]] = []
    for movement, recorder in track(ACCELERATIONS, "accelerations", transient=True):
        errors = np.array([acceleration_errors(movement, recorder, seed) for seed in range(seeds)])
        ours, best = errors.T
        assert movement.accelerations is not None
        signal = rms(movement.accelerations(np.linspace(0, movement.duration, 1001)))
        rows.append(
            {
                "case": f"{movement.name}, {recorder}",
                "signal": signal,
                "learned": [float(np.median(ours)), float(ours.max())],
                "best window": [float(np.median(best)), float(best.max())],
                "ratio": [float(np.median(ours / best)), float((ours / best).max())],
                "above a tenth": int(np.sum((best < signal / 20) & (ours > signal / 10))),
            }
        )
    return rows


def places(seeds: int) -> list[dict[str, object]]:
    """Return the largest distance from the movement, rad, for every movement and recorder over the seeds."""
    rows: list[dict[str, object]] = []
    for movement in track(PLACES, "places", transient=True):
        for recorder in RECORDERS:
            found, beside = [], 0.0
            for seed in range(seeds):
                times, positions = recorder.record(movement, seed)
                demonstration = Demonstration(times, positions[:, None])
                primitive = learn(demonstration)
                shown = movement.positions(times)
                beside = max(beside, float(np.abs(primitive.positions(demonstration.phases)[:, 0] - shown).max()))
                found.append(primitive.basis_count)
            span = float(np.ptp(movement.positions(np.linspace(0, movement.duration, 1001))))
            rows.append(_place(f"{movement.name}, {recorder}", beside, span, recorder.noise, max(found)))
    return rows


def recordings() -> list[dict[str, object]]:
    """Return the largest distances from the samples, rad, for recordings of an arm: the worst joint of each."""
    rows: list[dict[str, object]] = []
    for path in sorted(DEMOS.glob("*.csv")):
        positions = np.loadtxt(path, delimiter=",", skiprows=1)[:, 1:]
        primitive = learn(Demonstration(np.linspace(0, DEMO_DURATION, len(positions)), positions))
        ranges = np.ptp(positions, axis=0)
        worst = int(np.argmax(primitive.position_max / np.maximum(0.01 * ranges, 0.005)))
        noise = float(primitive.noise_estimate[worst])
        beside = float(primitive.position_max[worst])
        name = f"{path.stem.split('_')[1]}, joint {worst + 1}"
        rows.append(_place(name, beside, float(ranges[worst]), noise, primitive.basis_count))
    return rows


def _place(case: str, beside: float, span: float, noise: float, count: int) -> dict[str, object]:
    bound = max(0.01 * span, 0.005, 2 * noise)
    return {"case": case, "beside": beside, "range": span, "bound": bound, "basis_count": count}


def durations() -> dict[str, float]:
    """Return the duration of learning, s, in a second run."""
    rng = np.random.default_rng(0)
    found = {}
    for samples, joints in SIZES:
        times = np.arange(samples) / 1000
        positions = 0.5 * np.sin(np.outer(times, rng.uniform(0.5, 6, joints))) + 1e-3 * rng.standard_normal(
            (samples, joints)
        )
        for _ in range(2):
            began = time.perf_counter()
            learn(Demonstration(times, positions))
            found[f"{samples} x {joints}"] = time.perf_counter() - began
    return found


def main(seeds: int = 200, place_seeds: int = 5) -> None:
    """Record every movement this many times, learn it, and print and save the errors."""
    console = Console()
    compared, kept, shown, took = accelerations(seeds), places(place_seeds), recordings(), durations()
    title = f"Acceleration error, rad/s² rms: median (worst) of {seeds}"
    table = Table("", "signal", "learned", "best window", "ratio", "above a tenth", title=title)
    for row in compared:
        pairs = ("{:.3g} ({:.3g})".format(*row[name]) for name in ("learned", "best window", "ratio"))  # type: ignore[misc]
        table.add_row(str(row["case"]), f"{row['signal']:.3g}", *pairs, str(row["above a tenth"]))
    console.print(table)
    table = Table("", "functions", "range rad", "beside mrad", "bound mrad", title="Largest deviation in position")
    for row in (*kept, *shown):
        beside, bound = float(row["beside"]), float(row["bound"])  # type: ignore[arg-type]
        style = "red" if beside > bound else ""
        numbers = f"{row['range']:.3g}", f"{1e3 * beside:.3g}", f"{1e3 * bound:.3g}"
        table.add_row(str(row["case"]), str(row["basis_count"]), *numbers, style=style)
    console.print(table)
    console.print(", ".join(f"{size}: {seconds:.2f} s" for size, seconds in took.items()))
    results = {"accelerations": compared, "places": kept, "recordings": shown, "seconds": took}
    console.print(f"saved to {save('learning', results).name}")


if __name__ == "__main__":
    tyro.cli(main)
