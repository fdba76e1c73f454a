"""Section IV-C, fig. 4: a waypoint at 0.5 s, and its effect on the acceleration."""

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
    demonstrated,
    figure_primitive,
    gaussian,
    limits,
    played,
    qp,
    rms,
    spread,
    state,
)
from motion.errors import Infeasible
from motion.primitive import Primitive

TIME, POSITION = 0.5, 1.0  # s, rad
VELOCITIES = {"demonstrated": 1.0, "other": -3.0}  # rad/s
MAX_JERK = 2500.0  # rad/s³; the demonstration itself reaches 1.85e3
MET = "waypoints can be added in the same way as the final goal (IV-C)"
KINK = "a small discontinuity in the acceleration near the waypoint, only after it (IV-C)"
JERK = "this can be mitigated by a jerk limit (IV-C)"
RESEMBLES = "the shape highly resembles the demonstrated one (IV-C)"


def run() -> Outcome:
    """Run two velocities at the waypoint, and random waypoints.

    The paper's QP is used with and without a limit on the jerk, Volley's with it.
    """
    primitive = figure_primitive()
    shown, rows = {}, [Row("fig4.demonstration.largest_jerk", largest_jerk(demonstrated(TIMES)[2]), "rad/s³")]
    within = limits(jerk=MAX_JERK)
    cases = ("free", gaussian, None), ("jerk_limited", gaussian, within), ("qp", qp, within)
    for name, velocity in VELOCITIES.items():
        for case, method, bounds in cases:
            made, motion = method(primitive, ask(within=bounds, waypoint=(TIME, POSITION, velocity)))
            shown[f"{name}.{case}"] = motion
            rows += single(f"fig4.{name}.{case}", motion, velocity, made.report.extremes["jerk"][0])
    return Outcome(rows + random_waypoints(primitive), picture(shown), curves("fig4", TIMES, shown))


def single(name: str, motion: np.ndarray, velocity: float, jerk: np.ndarray) -> list[Row]:
    """Return errors at the waypoint and at the end, and the jerk on either side of the waypoint."""
    at = round(TIME / STEP)
    deviation = np.diff(motion[2] - demonstrated(TIMES)[2]) / STEP
    before, after = (np.abs(deviation[part]).max() for part in (slice(at - 60, at), slice(at, at + 60)))
    claim = KINK if name.endswith("free") else JERK
    return [
        Row(f"{name}.position_error", abs(motion[0, at] - POSITION), "rad", MET),
        Row(f"{name}.velocity_error", abs(motion[1, at] - velocity), "rad/s", MET),
        Row(f"{name}.final_position_error", abs(motion[0, -1] - 1.0), "rad", MET),
        Row(f"{name}.final_velocity_error", abs(motion[1, -1] - 3.0), "rad/s", MET),
        Row(f"{name}.largest_jerk", float(np.abs(jerk).max()), "rad/s³", claim),
        Row(f"{name}.added_jerk_before", float(before), "rad/s³", claim),
        Row(f"{name}.added_jerk_after", float(after), "rad/s³", claim),
        Row(f"{name}.imitation_rms", rms(motion[2] - played(1.0, 1001)), "rad/s²", RESEMBLES),
    ]


def largest_jerk(accelerations: np.ndarray) -> float:
    """Return the largest change of acceleration (n,) in a sample, rad/s³."""
    return float(np.abs(np.diff(accelerations)).max() / STEP)


def random_waypoints(primitive: Primitive) -> list[Row]:
    """Return errors and jerks at waypoints of random time, position and velocity."""
    rng = np.random.default_rng(4)
    errors, jerks, limited, infeasible = [], [], [], 0
    for _ in range(GOALS):
        time = round(rng.uniform(0.15, 0.85), 3)
        demonstrated_there = demonstrated(np.array([time]))[:2, 0]
        position, velocity = demonstrated_there + rng.uniform((-0.5, -5), (0.5, 5))
        start, goal = state(rng.uniform(-0.5, 0.5), -1.0), state(rng.uniform(0.5, 1.5), rng.uniform(0, 5))
        wanted = (time, position, velocity)
        made, motion = gaussian(primitive, ask(start, goal, waypoint=wanted))
        at = round(time / STEP)
        errors.append((abs(motion[0, at] - position), abs(motion[1, at] - velocity)))
        jerks.append(np.abs(made.report.extremes["jerk"]).max())
        try:
            made, _ = gaussian(primitive, ask(start, goal, within=limits(jerk=2 * MAX_JERK), waypoint=wanted))
            limited.append(np.abs(made.report.extremes["jerk"]).max())
        except Infeasible:
            infeasible += 1
    positions, velocities = np.array(errors).T
    return [
        Row("fig4.random.largest_position_error", positions.max(), "rad", MET),
        Row("fig4.random.largest_velocity_error", velocities.max(), "rad/s", MET),
        *spread("fig4.random.largest_jerk", jerks, "rad/s³", KINK),
        Row("fig4.random.jerk_limited.largest_jerk", max(limited), "rad/s³", JERK),
        Row("fig4.random.jerk_limited.infeasible", infeasible / GOALS, "share of goals", JERK),
    ]


def picture(shown: dict[str, np.ndarray]) -> Figure:
    """Draw the demonstrated velocity at the waypoint (left) and another one (right)."""
    figure, axes = style.panels(
        "Fig. 4  A waypoint at 0.5 s, 1.0 rad: with the demonstration's velocity there (left) and another (right)",
        2 * (*style.UNITS, "jerk, rad/s³"),
        columns=2,
    )
    jerk_times = TIMES[1:] - STEP / 2
    for name, part in zip(VELOCITIES, (axes[:4], axes[4:]), strict=True):
        style.draw(part[:3], TIMES, list(demonstrated(TIMES)), "demonstration", "demonstration", linewidth=1.2)
        for limit, colour, label in (
            ("free", "gaussian", "QP of the paper"),
            ("jerk_limited", "gaussian variant", f"the same, jerk at most {MAX_JERK:.0f} rad/s³"),
            ("qp", "qp", "QP of Volley, the same limit"),
        ):
            motion = shown[f"{name}.{limit}"]
            dashes = {
                "linestyle": (0, (4, 2)) if limit == "jerk_limited" else "-",
                "linewidth": 0.9 if limit == "qp" else 1.8,
            }
            style.draw(part[:3], TIMES, list(motion), colour, label, **dashes)
            style.draw(part[3:], jerk_times, [np.diff(motion[2]) / STEP], colour, label, **dashes)
        style.bound(part[3], (MAX_JERK, -MAX_JERK), "limit on the jerk")
        style.mark(part, TIME, (POSITION, VELOCITIES[name]), "waypoint")
        style.mark(part, 1.0, (1.0, 3.0), "goal", marker="s")
        for ax in part:
            ax.axvline(TIME, color="black", linewidth=0.6, linestyle=":")
    axes[0].set_ylim(-3.4, 1.3)
    style.legend(axes[0], loc="lower center", ncols=2)
    for ax in (axes[3], axes[7]):
        ax.set_ylim(-5800, 4700)
    style.legend(axes[3], loc="lower center", ncols=2)
    return figure
