"""One goal, three methods: Volley's, the paper's and a dynamic movement primitive, planned without moving.

    volley up                                     # in another shell
    python examples/qp_beside_dmp.py [ENDPOINT]

Printed are how unlike the demonstration the accelerations are, the largest acceleration, and whether the limits hold at
every instant. A method that leaves its limits is refused rather than played.
"""

import sys
from typing import Literal

from client import Arm, GoalFields, Refusal, connect

GOALS: dict[str, GoalFields] = {
    "to its own end": {},
    "farther and faster": {
        "positions": [0.3, 0.5, 0.8, -0.1, 0.0, 0.1],
        "velocities": [5.5, -0.4, -0.3, -0.8, -0.4, 1.2],
        "duration": 0.85,
    },
    "much sooner": {"duration": 0.55},
}
METHODS: tuple[Literal["qp", "gaussian", "dmp"], ...] = ("qp", "gaussian", "dmp")


def compare(arm: Arm, fields: GoalFields) -> None:
    """Plan a goal by every method and print a line each."""
    for method in METHODS:
        try:
            report = arm.plan("forehand", **{**fields, "method": method}).report
        except Refusal as refusal:
            print(f"  {method:9} refused, {refusal.code}: {refusal}")
            continue
        largest = max(max(abs(low), abs(high)) for low, high in report.extremes.accelerations)
        held = "certified" if report.certified else "held at its samples"
        print(f"  {method:9} unlike by {max(report.imitation_rms):6.2f} rad/s² rms; {largest:5.0f} rad/s²; {held}")


def main(endpoint: str | None = None) -> None:
    """Compare the methods on every goal."""
    with connect(endpoint) as arm:
        for title, fields in GOALS.items():
            print(f"{title}:")
            compare(arm, fields)


if __name__ == "__main__":
    main(*sys.argv[1:])
