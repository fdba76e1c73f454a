"""Section IV-A, fig. 2: another start, another final velocity, 0.8 s instead of 1.0 s."""

import numpy as np
from matplotlib.figure import Figure

from experiments import style
from experiments.common import (
    DEMONSTRATED_GOAL,
    DEMONSTRATED_START,
    GOALS,
    STEP,
    Outcome,
    Row,
    ask,
    curves,
    demonstrated,
    figure_primitive,
    gaussian,
    played,
    qp,
    rms,
    rollout,
    spread,
    state,
)
from motion.dmp import learn_dmp, moving_goal
from motion.primitive import Primitive
from motion.request import MotionRequest

DURATION = 0.8
START, GOAL = state(0.5, -1.0), state(1.0, 5.0)
REST_FRACTION = 0.05
CLAIM = "the QP imitates better, especially in the final part (IV-A)"


def run() -> Outcome:
    """Run the single case, the variant without acceleration at the end, and random goals."""
    primitive = figure_primitive()
    request = ask(START, GOAL, DURATION)
    resting = ask(START, GOAL, DURATION, rest_fraction=REST_FRACTION)
    shown = {
        "gaussian": gaussian(primitive, request)[1],
        "gaussian_rest": gaussian(primitive, resting)[1],
        "qp": qp(primitive, request)[1],
        "qp_rest": qp(primitive, resting)[1],
        "dmp": rollout(learn_dmp(primitive), request),
    }
    rows = [row for name, values in shown.items() for row in single(f"fig2.{name}", values)]
    exact = exact_deviations(request, shown["qp"].shape[1])[1]
    aim = played(DURATION, len(exact))
    for name in ("gaussian", "qp"):
        beside = np.abs(shown[name][2] - aim - exact)
        rows.append(Row(f"fig2.{name}.largest_beside_exact", float(beside.max()), "rad/s²"))
    rows += ratios("fig2", shown["dmp"][2], shown["gaussian"][2], DURATION)
    rows += random_goals(primitive)
    times = np.arange(len(exact)) * STEP
    return Outcome(rows, picture(times, shown), curves("fig2", times, {**shown, "demonstration": scaled(times)}))


def single(name: str, motion: np.ndarray) -> list[Row]:
    """Return imitation errors and final errors of one motion (3, n), by exact integrals and by Euler's rule."""
    deviation = motion[2] - played(DURATION, motion.shape[1])
    euler_velocity = motion[1, 0] + STEP * motion[2, :-1].sum()
    rows = [
        Row(f"{name}.imitation_rms", rms(deviation), "rad/s²", CLAIM),
        Row(f"{name}.imitation_rms_last_fifth", rms(last_fifth(deviation)), "rad/s²", CLAIM),
        Row(f"{name}.final_position_error", abs(motion[0, -1] - GOAL.positions[0]), "rad"),
        Row(f"{name}.final_velocity_error", abs(motion[1, -1] - GOAL.velocities[0]), "rad/s"),
        Row(f"{name}.final_acceleration", motion[2, -1], "rad/s²"),
    ]
    if name != "fig2.dmp":
        claim = "non-zero final accelerations may increase the final velocity error (IV-A)"
        error = abs(euler_velocity - GOAL.velocities[0])
        rows.append(Row(f"{name}.final_velocity_error_euler", error, "rad/s", claim))
        one_tick_late = abs(motion[2, -1]) * STEP
        rows.append(Row(f"{name}.velocity_error_of_a_tick", one_tick_late, "rad/s", claim))
    return rows


def last_fifth(values: np.ndarray) -> np.ndarray:
    """Return the samples in the last fifth of a motion."""
    return values[round(0.8 * (len(values) - 1)) :]


def ratios(name: str, dmp: np.ndarray, paper: np.ndarray, duration: float) -> list[Row]:
    """Return the DMP's imitation error over that of the paper's QP, from accelerations (n,)."""
    aim = played(duration, len(paper))
    return [
        Row(f"{name}.ratio", rms(dmp - aim) / rms(paper - aim), "1", CLAIM),
        Row(f"{name}.ratio_last_fifth", rms(last_fifth(dmp - aim)) / rms(last_fifth(paper - aim)), "1", CLAIM),
    ]


def random_goals(primitive: Primitive) -> list[Row]:
    """Return the DMP's ratios to the paper's QP for many goals, and those of B-splines.

    The DMP is learned as in this project, as by the authors, and exactly.
    """
    rng = np.random.default_rng(2)
    variants = {"dmp": learn_dmp(primitive), "coarse_dmp": learn_dmp(primitive, basis_count=60, gain=50.0)}
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in (*variants, "exact")}
    final_errors, splines = [], []
    for _ in range(GOALS):
        start = state(rng.uniform(-1, 1), rng.uniform(-3, 3))
        request = ask(start, state(rng.uniform(-1, 3), rng.uniform(-5, 8)), round(rng.uniform(0.5, 1.6), 3))
        paper = gaussian(primitive, request)[1][2]
        aim = played(request.duration, len(paper))
        for name, dmp in variants.items():
            motion = rollout(dmp, request)
            found[name].append(compare(motion[2] - aim, paper - aim))
            if name == "dmp":
                final_errors.append(abs(motion[1, -1] - request.goal.velocities[0]))
        found["exact"].append(compare(*exact_deviations(request, len(paper))))
        splines.append(rms(qp(primitive, request)[1][2] - aim) / rms(paper - aim))
    rows = [row for name, values in found.items() for row in summary(f"fig2.random.{name}", values)]
    rows += spread("fig2.random.dmp.final_velocity_error", final_errors, "rad/s")
    return rows + spread("fig2.random.qp.ratio_to_gaussian", splines, "1")


def compare(dmp: np.ndarray, paper: np.ndarray) -> tuple[float, float, float]:
    """Return the ratio over the whole motion and its last fifth, and the DMP's share of squared deviation in it."""
    share = np.sum(last_fifth(dmp) ** 2) / np.sum(dmp**2)
    return rms(dmp) / rms(paper), rms(last_fifth(dmp)) / rms(last_fifth(paper)), float(share)


def summary(name: str, values: list[tuple[float, float, float]]) -> list[Row]:
    """Return the spread of the ratios and how often the DMP is better."""
    whole, end, _ = np.array(values).T
    return [
        *spread(f"{name}.ratio", whole, "1", CLAIM),
        *spread(f"{name}.ratio_last_fifth", end, "1", CLAIM),
        Row(f"{name}.better_in_last_fifth", float(np.mean(end < 1)), "share of goals", CLAIM),
    ]


def exact_deviations(request: MotionRequest, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return g̈ − τ²d̈ (count,) of the DMP and of the QP with exact learning.

    They are the second derivatives of a quintic and of a cubic between the differences from the demonstration.
    """
    s, duration = np.linspace(0, 1, count), request.duration
    ends = [
        state(
            (mine.positions - its.positions)[0],
            (mine.velocities - its.velocities / duration)[0],
        )
        for mine, its in ((request.start, DEMONSTRATED_START), (request.goal, DEMONSTRATED_GOAL))
    ]
    dmp = moving_goal("polynomial", ends[0], ends[1], duration, s)[2][:, 0]
    travel = (ends[1].positions - ends[0].positions - duration * ends[0].velocities)[0]
    gain = duration * (ends[1].velocities - ends[0].velocities)[0]
    return dmp, (6 * travel - 2 * gain + (6 * gain - 12 * travel) * s) / duration**2


def picture(times: np.ndarray, shown: dict[str, np.ndarray]) -> Figure:
    """Draw the motions, the demonstration in the same time, and the distance of accelerations from it."""
    figure, axes = style.panels(
        "Fig. 2  Another start (0.5 rad), another final velocity (5 rad/s), 0.8 s instead of 1.0 s",
        (*style.UNITS, "acceleration less\ndemonstration's, rad/s²"),
    )
    aim = scaled(times)
    for values, name, label, width in (
        (aim, "demonstration", "demonstration, in 0.8 s", 1.2),
        (shown["gaussian"], "gaussian", "QP of the paper (50 Gaussians)", 2.0),
        (shown["gaussian_rest"], "gaussian variant", f"the same, no acceleration in the last {REST_FRACTION:.0%}", 1.2),
        (shown["qp"], "qp", "QP of Volley (B-splines)", 1.2),
        (shown["dmp"], "dmp", "DMP (eq. 6–7)", 1.6),
    ):
        style.draw(axes[:3], times, list(values), name, label, linewidth=width)
        if name != "demonstration":
            style.draw(axes[3:], times, [values[2] - aim[2]], name, label, linewidth=width)
    axes[0].set_ylim(-3.4, 1.3)
    axes[3].set_ylim(-52, 30)
    style.mark(axes, DURATION, (GOAL.positions[0], GOAL.velocities[0]), "goal")
    axes[3].axvspan(0.8 * DURATION, DURATION, color="#000000", alpha=0.06, label="last fifth")
    for ax in (axes[0], axes[3]):
        style.legend(ax, loc="lower center", ncols=3)
    return figure


def scaled(times: np.ndarray) -> np.ndarray:
    """Return the demonstration (3, n) played in the new duration."""
    return demonstrated(times / DURATION) / DURATION ** np.arange(3)[:, None]
