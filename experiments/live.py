"""Fig. 5 on the MuJoCo arm: the running services on a router of their own, on the stepped clock, recorded.

The first joint plays the figures' demonstration, beginning at rest as the arm does. The DMP would begin with an
acceleration jump of 170 rad/s², which the planner refuses. Both methods are therefore compared on the shipped forehand,
which begins at rest.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Literal

import numpy as np
from matplotlib.figure import Figure

from deploy.demonstrations.make_forehand import HIT, HIT_VELOCITIES
from experiments import style
from experiments.common import STEP, TIMES, Outcome, Row, demonstrated
from experiments.fig5 import NOISE, PUSH, PUSH_FROM, PUSH_TO, RECOVERED, RECOVERS
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from robot.description import load_robot
from services.common.cell import running_cell

PATIENCE_S = 20.0
SETTLE_TICKS = 20


@dataclass(frozen=True, slots=True)
class Case:
    """A motion with a push: its name, its goal, whether the sensors are noisy."""

    name: str
    goal: m.Goal
    noisy: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Played:
    """The outcome of a case: the motion of the first joint and the controller's result.

    true, reference: position and velocity, (2, n), from the start of the motion on. hit: index of the hit among them.
    """

    true: np.ndarray
    reference: np.ndarray
    hit: int
    result: m.Result


def run(trace: Path) -> Outcome:
    """Play every case and record all of them in `trace`."""
    trace.parent.mkdir(parents=True, exist_ok=True)
    with running_cell(flags={"clock": "stepped", "record": trace.resolve()}, quiet=True) as cell:
        arm = Arm(cell.bus)
        home = load_robot().home.tolist()
        learn_figure(cell.bus, home)
        cases = all_cases(home)
        shown = {case.name: arm.play(case, seed) for seed, case in enumerate(cases, 1)}
    rows = [row for name, played in shown.items() for row in measured(f"live.{name}", played)]
    return Outcome(rows, picture(shown))


def learn_figure(bus: Bus, home: list[float]) -> None:
    """Let the planner learn the figures' demonstration for the first joint; the others rest at home."""
    positions = np.tile(home, (len(TIMES), 1))
    positions[:, 0] += demonstrated(TIMES)[0]
    bus.ask(topics.LEARN, m.Learn(name="figure", positions=positions.tolist(), rate=1 / STEP, smoothing="none"))


def all_cases(home: list[float]) -> list[Case]:
    """Return the figures' demonstration, without and with noise, and the forehand by either method."""
    figure = m.Goal(primitive="figure", positions=[home[0] + 1.0, *home[1:]], velocities=[3.0, *5 * [0.0]])
    forehand, dmp = (
        m.Goal(primitive="forehand", positions=list(HIT), velocities=list(HIT_VELOCITIES), method=method)
        for method in ("qp", "dmp")
    )
    return [
        Case("figure", figure),
        Case("figure_noisy", figure, noisy=True),
        Case("forehand_qp", forehand, noisy=True),
        Case("forehand_dmp", dmp, noisy=True),
    ]


class Arm:
    """The arm of the running services, its states and commands."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._states: SimpleQueue[bytes] = SimpleQueue()
        self._commands: SimpleQueue[bytes] = SimpleQueue()
        bus.listen(topics.STATE, self._states.put)
        bus.listen(topics.COMMAND, self._commands.put)

    def play(self, case: Case, seed: int) -> Played:
        """Begin a run, play the case with its push, and collect the arm's motion."""
        self._bus.ask(topics.SIM_RESET, m.Reset(seed=seed))
        self._blur(case)
        self._bus.ask(topics.SIM_STEP, m.Step(ticks=SETTLE_TICKS))
        reply = self._bus.ask(topics.GOAL, case.goal)
        begin = reply.start_time + PUSH_FROM
        push = m.Disturb(kind="acceleration", values=[PUSH, *5 * [0.0]], start_time=begin, duration=PUSH_TO - PUSH_FROM)
        self._bus.ask(topics.SIM_DISTURB, push)
        first, last = (round(t / STEP) for t in (reply.start_time, reply.start_time + reply.total_duration))
        self._bus.ask(topics.SIM_STEP, m.Step(ticks=last + 2 - SETTLE_TICKS))
        states = self._gathered(self._states, m.State, seed, last)
        commands = self._gathered(self._commands, m.Command, seed, last)
        truths = [states[tick].truth for tick in range(first, last + 1)]
        return Played(
            true=np.array([[t.positions[0], t.velocities[0]] for t in truths if t]).T,
            reference=np.array(
                [[c.positions[0], c.velocities[0]] for c in map(commands.get, range(first, last + 1)) if c]
            ).T,
            hit=round(reply.duration / STEP),
            result=self._bus.ask(topics.RESULT, m.ResultRequest(goal_id=reply.goal_id)),
        )

    def _blur(self, case: Case) -> None:
        """Set sensor noise with the standard deviation of fig. 5's uniform noise, or none."""
        share = NOISE / math.sqrt(3) if case.noisy else 0.0
        position, velocity = (share * float(np.abs(values).max()) for values in demonstrated(TIMES)[:2])
        self._bus.ask(topics.SIM_DISTURB, m.Disturb(kind="sensor_noise", position_std=position, velocity_std=velocity))

    def _gathered(self, bodies: SimpleQueue[bytes], message: type, run: int, last: int) -> dict:
        """Return all messages of a run by their tick, up to `last`."""
        found = {}
        while last not in found:
            received = decode(bodies.get(timeout=PATIENCE_S), message)
            if received.run == run:
                found[received.tick] = received
        return found


def measured(name: str, played: Played) -> list[Row]:
    """Return peak deviation, recovery, and errors of the true arm at the hit."""
    deviation = played.true - played.reference
    outside = np.append(round(PUSH_TO / STEP), np.flatnonzero(np.abs(deviation[0, : played.hit]) > RECOVERED))
    return [
        Row(f"{name}.succeeded", float(played.result.outcome == "succeeded"), "1 = yes"),
        Row(f"{name}.peak_deviation", float(np.abs(deviation[0]).max()), "rad"),
        Row(f"{name}.recovery_time", (outside.max() + 1) * STEP - PUSH_TO, "s after the push", RECOVERS),
        Row(f"{name}.hit_position_error", float(abs(deviation[0, played.hit])), "rad", RECOVERS),
        Row(f"{name}.hit_velocity_error", float(abs(deviation[1, played.hit])), "rad/s", RECOVERS),
    ]


def picture(shown: dict[str, Played]) -> Figure:
    """Draw the first joint: the figures' demonstration (left) and the forehand (right)."""
    labels = (*style.UNITS[:2], "position less\nreference, rad")
    figure, axes = style.panels(
        "Fig. 5 on the MuJoCo arm  The same push and noise on its first joint, gain 50/s (stepped clock)",
        2 * labels,
        columns=2,
    )
    cases = (
        (axes[:3], "figure_noisy", "qp", "QP, the figures' demonstration"),
        (axes[3:], "forehand_qp", "qp", "QP, forehand"),
        (axes[3:], "forehand_dmp", "dmp", "DMP, forehand"),
    )
    for part, name, colour, label in cases:
        played = shown[name]
        times = np.arange(played.true.shape[1]) * STEP
        style.draw(part[:2], times, list(played.reference), "demonstration", "reference", linewidth=1.2, linestyle="--")
        values = [*played.true, played.true[0] - played.reference[0]]
        style.draw(part, times, values, colour, label, linestyle="--" if colour == "dmp" else "-")
        style.bound(part[2], (RECOVERED, -RECOVERED), "counts as recovered", linewidth=0.9)
        for ax in part:
            ax.axvline(played.hit * STEP, color="black", linewidth=0.8, linestyle=":", label="hit")
    for ax in axes:
        ax.axvspan(PUSH_FROM, PUSH_TO, color="#000000", alpha=0.07, label="push")
    places: tuple[tuple[int, Literal["lower right", "upper right", "upper center"]], ...] = (
        (0, "lower right"),
        (2, "upper right"),
        (3, "upper center"),
        (5, "upper right"),
    )
    for number, place in places:
        handles = dict(zip(*reversed(axes[number].get_legend_handles_labels()), strict=True))
        axes[number].legend(handles.values(), handles.keys(), fontsize=8, loc=place)
    return figure
