"""Section II-B: the two drawbacks of the hitting primitive with a linearly moving goal (ref. 15)."""

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
    demonstration,
    figure_primitive,
    rollout,
    spread,
    state,
)
from motion.dmp import Dmp, System, integrate, learn_dmp
from motion.primitive import learn
from motion.request import Boundary

SYSTEMS: dict[System, str] = {"linear": "linearly moving goal (ref. 15)", "polynomial": "fifth-order goal (eq. 6–7)"}
CHANGES = (0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9, 0.95)
NETS = (1.0, 0.3, 0.1, 0.03, 0.01)
LATE = "fast changes of goal position and velocity lead to error in the final velocity (II-B)"
CLOSE = "start and end close to each other: large accelerations (II-B)"


def run() -> Outcome:
    """Measure goals that change during the motion, and demonstrations that end near their start."""
    late, close = {}, {}
    rows: list[Row] = []
    rng = np.random.default_rng(5)
    free = np.full(GOALS, np.nan)
    new_goals = Boundary(1.0 + rng.uniform(-0.5, 0.5, GOALS), 3.0 + rng.uniform(-2, 2, GOALS), free)
    for system in SYSTEMS:
        dmp = learn_dmp(figure_primitive(), system)
        errors = np.array([final_velocity_errors(dmp, new_goals, at) for at in CHANGES])
        late[system], close[system] = np.median(errors, axis=1), [peak_acceleration(system, net) for net in NETS]
        for at in (0.4, 0.8):
            rows += spread(f"hitting.{system}.goal_changed_at_{at}", errors[CHANGES.index(at)], "rad/s", LATE)
        for net, peak in zip(NETS, close[system], strict=True):
            rows.append(Row(f"hitting.{system}.peak_learned_from_net_{net}", peak, "rad/s²", CLOSE))
    return Outcome(rows, picture(late, close))


def final_velocity_errors(dmp: Dmp, goals: Boundary, at: float) -> np.ndarray:
    """Return the final velocity errors (rad/s) when the goal changes to each of `goals` at s = `at`."""
    old = ask()
    count = len(goals.positions)
    start, before = (
        Boundary(*(np.repeat(x, count) for x in (b.positions, b.velocities, b.accelerations)))
        for b in (old.start, old.goal)
    )
    drives = [dmp.drive(start, goal, 1.0, STEP) for goal in (before, goals)]
    drive = np.where((at > TIMES)[:, None], *drives)
    return np.abs(integrate(drive, start, 1.0, dmp.gain).velocities[-1] - goals.velocities)


def peak_acceleration(system: System, net: float) -> float:
    """Return the peak acceleration (rad/s²) to a goal 0.5 rad away, learned from a motion that ends `net` rad away."""
    blend = 10 * TIMES**3 - 15 * TIMES**4 + 6 * TIMES**5
    primitive = learn(demonstration(np.sin(np.pi * TIMES) ** 4 + net * blend), "none")
    request = ask(primitive.start, state(0.5, 0.0))
    return float(np.abs(rollout(learn_dmp(primitive, system), request)[2]).max())


def picture(late: dict, close: dict) -> Figure:
    """Draw both drawbacks over their causes."""
    figure, axes = style.panels(
        "Section II-B  The two drawbacks of the linearly moving goal, beside the fifth-order one",
        ("final velocity error, rad/s\n(median of 200 new goals)", "largest acceleration, rad/s²"),
        columns=2,
        height=3.2,
    )
    for name, (system, label) in zip(("dmp variant", "dmp"), SYSTEMS.items(), strict=True):
        axes[0].semilogy(CHANGES, late[system], "o-", color=style.COLOURS[name], label=label)
        axes[1].loglog(NETS, close[system], "o-", color=style.COLOURS[name], label=label)
    axes[0].set_xlabel("part of the motion after which the goal changes")
    axes[1].set_xlabel("distance between the demonstration's ends, rad (goal: 0.5 rad away)")
    style.legend(axes[0])
    style.legend(axes[1])
    return figure
