"""Section IV-B, fig. 3: position limits of ±2 rad with a margin, for a motion that swings far."""

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
    rollout,
    spread,
    state,
)
from motion.dmp import learn_dmp
from motion.errors import Infeasible
from motion.primitive import Primitive

LIMIT, MARGIN = 2.0, 0.05  # rad
GOAL = state(-1.0, 10.0)
FEASIBLE = "the QP takes the limits and a margin into account (IV-B)"
INFEASIBLE = "a DMP generates an infeasible trajectory (IV-B)"
STILL_GOOD = "feasible and still a good approximation of the demonstration (IV-B)"


def run() -> Outcome:
    """Run the single case and random goals."""
    primitive = figure_primitive()
    within = limits(LIMIT - MARGIN)
    bounded, paper = gaussian(primitive, ask(goal=GOAL, within=within))
    certified, splines = qp(primitive, ask(goal=GOAL, within=within))
    shown = {
        "gaussian": paper,
        "gaussian_free": gaussian(primitive, ask(goal=GOAL))[1],
        "qp": splines,
        "dmp": rollout(learn_dmp(primitive), ask(goal=GOAL)),
    }
    rows = []
    for name, made in (("gaussian", bounded), ("qp", certified)):
        lowest, highest = made.report.extremes["position"][0]
        rows += [
            Row(f"fig3.{name}.certified", float(made.report.certified), "1 = yes"),
            Row(f"fig3.{name}.lowest", float(lowest), "rad", FEASIBLE),
            Row(f"fig3.{name}.highest", float(highest), "rad", FEASIBLE),
            Row(f"fig3.{name}.from_demonstration", float(made.report.from_demonstration.max[0]), "rad"),
        ]
    claims = {"dmp": INFEASIBLE, "gaussian": FEASIBLE, "qp": FEASIBLE}
    for name, values in shown.items():
        rows += [
            Row(f"fig3.{name}.largest_position", float(np.abs(values[0]).max()), "rad", claims.get(name)),
            Row(f"fig3.{name}.violation_time", violation_time(values[0]), "s", claims.get(name)),
            Row(f"fig3.{name}.imitation_rms", rms(values[2] - played(1.0, 1001)), "rad/s²", STILL_GOOD),
        ]
    return Outcome(rows + random_goals(primitive), picture(shown), curves("fig3", TIMES, shown))


def violation_time(positions: np.ndarray) -> float:
    """Return the time (s) beyond the limit itself."""
    return float(np.count_nonzero(np.abs(positions) > LIMIT) * STEP)


def random_goals(primitive: Primitive) -> list[Row]:
    """Return which methods leave the limits for goals all over the range, by how much, and the cost of keeping them."""
    rng = np.random.default_rng(3)
    dmp, within = learn_dmp(primitive), limits(LIMIT - MARGIN)
    excess = []
    methods = {"gaussian": gaussian, "qp": qp}
    cost: dict[str, list[float]] = {name: [] for name in methods}
    largest, infeasible = dict.fromkeys(methods, 0.0), dict.fromkeys(methods, 0)
    aim = played(1.0, 1001)
    for _ in range(GOALS):
        start = state(rng.uniform(-1, 1), rng.uniform(-3, 3))
        goal = state(rng.uniform(-1.8, 1.8), rng.uniform(-10, 10))
        rolled = rollout(dmp, ask(start, goal))
        excess.append(np.abs(rolled[0]).max() - LIMIT)
        for name, method in methods.items():
            try:
                made, motion = method(primitive, ask(start, goal, within=within))
            except Infeasible:
                infeasible[name] += 1
                continue
            largest[name] = max(largest[name], float(np.abs(made.report.extremes["position"]).max()))
            cost[name].append(rms(motion[2] - aim) / rms(rolled[2] - aim))
    violating = np.array(excess)[np.array(excess) > 0]
    rows = [
        Row("fig3.random.dmp.violating", len(violating) / GOALS, "share of goals", INFEASIBLE),
        *spread("fig3.random.dmp.excess", violating, "rad", INFEASIBLE),
    ]
    for name in methods:
        rows += [
            Row(f"fig3.random.{name}.infeasible", infeasible[name] / GOALS, "share of goals"),
            Row(f"fig3.random.{name}.largest_position", largest[name], "rad", FEASIBLE),
            *spread(f"fig3.random.{name}_to_dmp_imitation", cost[name], "1", STILL_GOOD),
        ]
    return rows


def picture(shown: dict[str, np.ndarray]) -> Figure:
    """Draw all three quantities with the limit and the margin."""
    figure, axes = style.panels(
        "Fig. 3  Goal −1.0 rad at 10 rad/s inside position limits of ±2.0 rad (margin 0.05 rad)", style.UNITS
    )
    for values, name, label, width in (
        (demonstrated(TIMES), "demonstration", "demonstration", 1.2),
        (shown["gaussian"], "gaussian", "QP of the paper inside the limits", 2.2),
        (shown["gaussian_free"], "gaussian variant", "the same without limits", 1.2),
        (shown["qp"], "qp", "QP of Volley inside the limits", 1.1),
        (shown["dmp"], "dmp", "DMP (eq. 6–7)", 1.6),
    ):
        style.draw(axes, TIMES, list(values), name, label, linewidth=width)
    style.bound(axes[0], (LIMIT, -LIMIT), "limit")
    style.bound(axes[0], (LIMIT - MARGIN, MARGIN - LIMIT), "limit less margin", linestyle=":", linewidth=0.9)
    style.mark(axes, 1.0, (GOAL.positions[0], GOAL.velocities[0]), "goal")
    axes[0].set_ylim(-3.6, 5.2)
    style.legend(axes[0], loc="upper left", ncols=3)
    return figure
