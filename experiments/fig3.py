"""Section IV-B, fig. 3: position limits of ±2 rad with a margin, for a goal that swings far."""

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
    column,
    curves,
    demonstrated,
    dynamic,
    figure_primitive,
    limits,
    played,
    polynomial,
    quadratic,
    rms,
    spread,
    state,
)
from motion.errors import Infeasible
from motion.primitive import Primitive

LIMIT, MARGIN = 2.0, 0.05  # rad
GOAL = state(-1.0, 10.0)
FEASIBLE = "the QP takes the limits and a margin into account (IV-B)"
INFEASIBLE = "a DMP generates an infeasible trajectory (IV-B)"
STILL_GOOD = "feasible and still a good approximation of the demonstration (IV-B)"


def run() -> Outcome:
    """The single case and random goals."""
    primitive = figure_primitive()
    within = limits(LIMIT - MARGIN)
    bounded, qp = quadratic(primitive, ask(goal=GOAL, within=within))
    _, free = quadratic(primitive, ask(goal=GOAL))
    dmp = dynamic(polynomial(primitive), ask(goal=GOAL))
    shown = {"qp": column(qp), "qp_free": column(free), "dmp": column(dmp)}
    lowest, highest = bounded.report.extremes["position"][0]
    rows = [
        Row("fig3.qp.certified", float(bounded.report.certified), "1 = yes", FEASIBLE),
        Row("fig3.qp.lowest", float(lowest), "rad", FEASIBLE),
        Row("fig3.qp.highest", float(highest), "rad", FEASIBLE),
    ]
    for name, values in shown.items():
        claim = INFEASIBLE if name == "dmp" else FEASIBLE if name == "qp" else None
        rows += [
            Row(f"fig3.{name}.largest_position", float(np.abs(values[0]).max()), "rad", claim),
            Row(f"fig3.{name}.violation_time", violation_time(values[0]), "s", claim),
            Row(f"fig3.{name}.imitation_rms", rms(values[2] - played(1.0, 1001)), "rad/s²", STILL_GOOD),
        ]
    curve_list = [c for name, values in shown.items() for c in curves("fig3", name, TIMES, values)]
    return Outcome(rows + random_goals(primitive), picture(shown), curve_list)


def violation_time(positions: np.ndarray) -> float:
    """How long (s) the limit itself is passed."""
    return float(np.count_nonzero(np.abs(positions) > LIMIT) * STEP)


def random_goals(primitive: Primitive) -> list[Row]:
    """Goals all over the range: who leaves the limits, by how much, and what keeping them costs."""
    rng = np.random.default_rng(3)
    dmp, within = polynomial(primitive), limits(LIMIT - MARGIN)
    excess, cost, qp_largest, infeasible = [], [], 0.0, 0
    for _ in range(GOALS):
        start = state(rng.uniform(-1, 1), rng.uniform(-3, 3))
        goal = state(rng.uniform(-1.8, 1.8), rng.uniform(-10, 10))
        rolled = column(dynamic(dmp, ask(start, goal)))
        excess.append(np.abs(rolled[0]).max() - LIMIT)
        try:
            made, samples = quadratic(primitive, ask(start, goal, within=within))
        except Infeasible:
            infeasible += 1
            continue
        qp_largest = max(qp_largest, float(np.abs(made.report.extremes["position"]).max()))
        aim = played(1.0, 1001)
        cost.append(rms(column(samples)[2] - aim) / rms(rolled[2] - aim))
    violating = np.array(excess)[np.array(excess) > 0]
    return [
        Row("fig3.random.dmp.violating", len(violating) / GOALS, "share of goals", INFEASIBLE),
        *spread("fig3.random.dmp.excess", violating, "rad", INFEASIBLE),
        Row("fig3.random.qp.infeasible", infeasible / GOALS, "share of goals"),
        Row("fig3.random.qp.largest_position", qp_largest, "rad", FEASIBLE),
        *spread("fig3.random.qp_to_dmp_imitation", cost, "1", STILL_GOOD),
    ]


def picture(shown: dict[str, np.ndarray]) -> Figure:
    """All three quantities with the limit and the margin."""
    figure, axes = style.panels(
        "Fig. 3  Goal −1.0 rad at 10 rad/s inside position limits of ±2.0 rad (margin 0.05 rad)", style.UNITS
    )
    for values, name, label, width in (
        (demonstrated(TIMES), "demonstration", "demonstration", 1.2),
        (shown["qp"], "qp", "QP inside the limits", 2.0),
        (shown["qp_free"], "qp variant", "QP without limits", 1.2),
        (shown["dmp"], "dmp", "DMP (eq. 6–7)", 1.6),
    ):
        style.draw(axes, TIMES, list(values), name, label, linewidth=width)
    style.bound(axes[0], (LIMIT, -LIMIT), "limit")
    style.bound(axes[0], (LIMIT - MARGIN, MARGIN - LIMIT), "limit less margin", linestyle=":", linewidth=0.9)
    for ax, value in zip(axes, (GOAL.positions[0], GOAL.velocities[0]), strict=False):
        ax.plot(1.0, value, "o", color="black", markersize=5, label="goal", zorder=5)
    axes[0].set_ylim(-3.6, 5.2)
    style.legend(axes[0], loc="upper left", ncols=3)
    return figure
