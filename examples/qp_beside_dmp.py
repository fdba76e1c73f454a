"""Compare three methods on one goal without moving: Volley's, the paper's and a dynamic movement primitive.

    volley up                                     # in another shell
    python examples/qp_beside_dmp.py [ENDPOINT]

The program prints the rms distance of each plan's acceleration from the demonstration's, the largest acceleration, and
whether the limits hold at all times or how much room the samples leave. To be played, a plan must keep its limits.
"""

import sys
from typing import Literal

from client import Arm, GoalFields, Refusal, connect
from client import messages as m

GOALS: dict[str, GoalFields] = {
    "to its own end": {},
    "farther and faster": {
        "positions": [0.3, 0.5, 0.8, -0.1, 0.0, 0.1],
        "velocities": [5.5, -0.4, -0.3, -0.8, -0.4, 1.2],
        "duration": 0.85,
    },
    "with less room to swing back": {"limits": m.GoalLimits(positions=[(-0.9, 2.0), *[None] * 5])},
}
METHODS: tuple[Literal["qp", "gaussian", "dmp"], ...] = ("qp", "gaussian", "dmp")


def compare(arm: Arm, fields: GoalFields) -> None:
    """Plan a goal from home by every method and print a line each."""
    home = m.Start(positions=arm.description().home)
    for method in METHODS:
        try:
            report = arm.plan("forehand", **{**fields, "start": home, "method": method}).report
        except Refusal as refusal:
            print(f"  {method:9} refused, {refusal.code}: {refusal}")
            continue
        largest = max(max(abs(low), abs(high)) for low, high in report.extremes.accelerations)
        room = min(margin for margin in report.margin.positions if margin is not None)
        held = "certified" if report.certified else f"{room:.2f} rad of room at its samples"
        print(f"  {method:9} unlike by {max(report.imitation_rms):6.2f} rad/s² rms; {largest:5.0f} rad/s²; {held}")


def main(endpoint: str | None = None) -> None:
    """Compare the methods on every goal."""
    with connect(endpoint) as arm:
        for title, fields in GOALS.items():
            print(f"{title}:")
            compare(arm, fields)


if __name__ == "__main__":
    main(*sys.argv[1:])
